"""Build hook: nothing is built or installed from a checkout that could not be imported."""

import runpy
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.config import BuilderConfig
from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class LinksHook(BuildHookInterface[BuilderConfig]):
    """Refuses a checkout without symbolic links in the words in which `import farside` does."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002 - theirs
        """Look before anything is collected.

        Raises:
            SystemExit: if the links are missing, so that pip shows one line and no traceback.
        """
        sys.path.insert(0, self.root)  # where it finds its own modules
        try:
            runpy.run_path(str(Path(self.root) / "farside" / "__init__.py"))
        except ImportError as error:
            sys.exit(str(error))
        finally:
            sys.path.remove(self.root)
