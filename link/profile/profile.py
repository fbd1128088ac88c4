"""A link as it is described, before files, presets and dates are made plain tables.

The one door: what is said of a link in a file, by the name of a preset, by `--set` and by the
control query is laid over what was said before, then checked and resolved as a whole.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import islice
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from farside.link.profile.config import Affected, LinkConfig
from farside.link.profile.layers import (
    LinkConfigError,
    alternatives_to,
    laid_over,
    profile_table,
    with_preset,
)
from farside.link.profile.plans.times import Window
from farside.link.profile.resolve import LightEnd, light_end, resolve_link
from farside.node import Direction, to_ns
from farside.validation import MAX_PROBLEMS, Problem, mismatches

if TYPE_CHECKING:
    from farside.link.profile.sky.positions import Orbit

_SCHEMA = msgspec.inspect.type_info(LinkConfig)


class Profile:
    """A link as it is described, which resolves to a `LinkConfig` for any time.

    Args:
        table: like the `[link]` table of a mission, unchecked; it may name a preset.
        folder: what paths in it are relative to.
        source: as the user named it, for error messages.
        texts: of the files that it names, by that name, where they need not be read.
        may_lack_delay: whether a direction may be without a delay, which is then 0.
    """

    def __init__(
        self,
        table: Mapping[str, Any],
        folder: Path = Path(),
        *,
        source: str = "",
        texts: Mapping[str, str] | None = None,
        may_lack_delay: bool = False,
    ) -> None:
        self._table = dict(table)
        self._folder, self._source = folder, source
        self._texts = dict(texts or {})
        self._kernels: dict[str, Sequence[Orbit]] = {}
        self._may_lack_delay = may_lack_delay
        self._checked: LinkConfig | None = None

    @classmethod
    def read(cls, source: str | Path) -> "Profile":
        """The profile in a TOML file, or of a preset; a file of that name comes first.

        Raises:
            LinkConfigError: if there is neither, or the file is not TOML.
        """
        try:
            return cls(profile_table(source), Path(source).parent, source=str(source))
        except LinkConfigError as error:
            raise LinkConfigError(*error.problems, source=str(source)) from error

    @classmethod
    def of(cls, config: LinkConfig) -> "Profile":
        """The profile that says no more than `config`, made in Python, is."""
        table = _said(config) | {way.value: _said(config.way(way)) for way in Direction}
        return cls(table, may_lack_delay=True)

    @property
    def table(self) -> Mapping[str, Any]:
        """What is said, unchecked, without what a preset adds to it."""
        return self._table

    def changed(self, layer: Mapping[str, Any], *, now_ns: int = 0) -> "Profile":
        """This profile with a table laid over it; see `farside.link.profile.layers`.

        Args:
            layer: like the `[link]` table of a mission, unchecked; a key that is `None` is removed.
            now_ns: since when this is said. It goes before what `changes` have made of the link by
                then; those that are to come take place.

        Raises:
            LinkConfigError: if it is nested too deeply.
        """
        try:
            table = laid_over(self._with_overruled(layer, now_ns), layer)
        except RecursionError as error:
            raise _too_deep() from error
        named = set(_strings(layer))
        # What is named anew is read anew.
        texts = {name: text for name, text in self._texts.items() if name not in named}
        profile = Profile(
            table,
            self._folder,
            source=self._source,
            texts=texts,
            may_lack_delay=self._may_lack_delay,
        )
        profile._kernels |= {
            name: orbits for name, orbits in self._kernels.items() if name not in named
        }
        return profile

    def resolved(self, window: Window) -> LinkConfig:
        """The link in plain tables, checked as a whole. Files are read once.

        Args:
            window: the simulated time that the tables have to cover.

        Raises:
            LinkConfigError: if something is invalid, or a file cannot be read. Nothing else is
                raised.
        """
        config = self.checked()
        with self._naming_the_source():
            return resolve_link(
                config,
                folder=self._folder,
                window=window,
                texts=self._texts,
                kernels=self._kernels,
                may_lack_delay=self._may_lack_delay,
            )

    def light_end(self) -> LightEnd | None:
        """Where the light times of its ephemeris end; `None` if it has none.

        Raises:
            LinkConfigError: as by `resolved`.
        """
        config, kernels = self.checked(), self._kernels
        with self._naming_the_source():
            return light_end(config, folder=self._folder, texts=self._texts, kernels=kernels)

    def checked(self) -> LinkConfig:
        """The link as it is described, its preset included, with files and dates unread.

        Raises:
            LinkConfigError: if a key or a value is invalid.
        """
        if self._checked is None:
            with self._naming_the_source():
                table = with_preset(self._table)
                if problems := list(islice(mismatches(table, _SCHEMA), MAX_PROBLEMS + 1)):
                    raise LinkConfigError(*problems)
                self._checked = msgspec.convert(table, LinkConfig)
        return self._checked

    @contextmanager
    def _naming_the_source(self) -> Iterator[None]:
        try:
            yield
        except LinkConfigError as error:
            raise LinkConfigError(*error.problems, source=self._source) from error
        except RecursionError as error:
            raise _too_deep() from error

    def _with_overruled(self, layer: Mapping[str, Any], now_ns: int) -> dict[str, Any]:
        """The table in which `changes` before `now_ns` do not undo what `layer` says."""
        if not now_ns or not (changes := with_preset(self._table).get("changes")):
            return self._table
        past = [one for one in changes if to_ns(one["at_s"]) < now_ns]
        coming = [one for one in changes if to_ns(one["at_s"]) >= now_ns]
        made = (_made(past, way, layer.get(way.value)) for way in Direction)
        return self._table | {"changes": [*(one for one in made if one), *coming]}


def load_profile(source: str | Path, duration_s: float) -> LinkConfig:
    """Read a profile, a TOML file or a preset, and resolve it.

    Args:
        source: path of the file, or the name of a preset; a file of that name comes first.
        duration_s: how much simulated time the tables have to cover.

    Raises:
        LinkConfigError: if the file cannot be read, or is invalid. Nothing else is raised.
    """
    return Profile.read(source).resolved(Window.of(duration_s))


def _made(past: Iterable[Mapping[str, Any]], way: Direction, said: object) -> dict[str, Any] | None:
    """What changes have made of one direction, as one change, but for the keys `said` anew."""
    keys = set(said) if isinstance(said, dict) else set()
    keys |= alternatives_to(keys)
    made: dict[str, Any] = {}
    at_s = 0.0
    for one in sorted(past, key=itemgetter("at_s")):
        if Affected(one.get("direction", Affected.BOTH)).includes(way):
            at_s = one["at_s"]
            made |= {key: value for key, value in one.items() if key not in keys}
    what = made.keys() - {"at_s", "direction"}
    return {**made, "at_s": at_s, "direction": way.value} if what else None


def _said(section: msgspec.Struct) -> dict[str, Any]:
    """The keys of a table that are not as they would be without being said."""
    perfect = type(section)()
    given = {
        name: value
        for name in section.__struct_fields__
        if (value := getattr(section, name)) != getattr(perfect, name)
    }
    plain: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(given))
    return plain


def _strings(value: object) -> Iterator[str]:
    match value:
        case str():
            yield value
        case dict():
            for entry in value.values():
                yield from _strings(entry)
        case list():
            for entry in value:
                yield from _strings(entry)


def _too_deep() -> LinkConfigError:
    return LinkConfigError(Problem((), "expected a link, found tables nested too deeply"))
