"""Controllers and operators of one's own: named in a mission, found, checked and made."""
