"""The page of `farside console`: the screen in a browser, with keys, pointer and gamepad."""
