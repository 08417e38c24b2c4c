"""Tables of plug-ins: what comes with mvcodec, and what other packages bring by entry points.

A plug-in is named by its specification, ``name`` or ``name:key=value,key=value``. In a value that is a
specification itself, ``/`` stands for the comma: ``dils:rematch=sad:window=9/median_size=5``.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, is_dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from mvcodec.errors import InputError, MvCodecWarning, SettingError
from mvcodec.settings import Setting, did_you_mean, settings_of, show

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

OWN_SOURCE = "mvcodec"
_NESTED_COMMA = "/"


@dataclass(frozen=True, slots=True)
class Plugin:
    """What a name stands for.

    Attributes:
        make: makes the object: from an instance of `settings`, or from nothing where there are none.
        settings: a frozen dataclass whose fields are made by `mvcodec.setting`, or None.
        help: what it does, one line.
        defaults: settings that are others under this name than in the dataclass.
    """

    make: Callable[..., Any]
    settings: type | None = None
    help: str = ""
    defaults: Mapping[str, Any] = field(default_factory=dict)

    @property
    def known(self) -> Mapping[str, Setting]:
        """Its settings by name."""
        return {} if self.settings is None else settings_of(self.settings)

    def default(self, key: str) -> Any:
        """The default of a setting."""
        return self.defaults.get(key, self.known[key].default)


@dataclass(frozen=True, slots=True)
class Chosen:
    """A specification, read and checked.

    Attributes:
        name, plugin: what was chosen.
        texts: settings as they were given, by name.
        values: the same as values.
    """

    name: str
    plugin: Plugin
    texts: Mapping[str, str]
    values: Mapping[str, Any]

    def make(self) -> Any:
        """The object.

        Raises:
            SettingError: settings that do not go together.
        """
        if self.plugin.settings is None:
            return self.plugin.make()
        return self.plugin.make(self.plugin.settings(**{**self.plugin.defaults, **self.values}))

    def specification(self) -> str:
        """The shortest specification: the name, and the settings that are not the default."""
        known = self.plugin.known
        given = [key for key in known if key in self.values and self.values[key] != self.plugin.default(key)]
        words = [f"{key}={self._text(key)}" for key in given]
        return f"{self.name}:{','.join(words)}" if words else self.name

    def all_settings(self) -> dict[str, Any]:
        """Every setting with its value, as plain JSON."""
        found = {key: self.plugin.default(key) for key in self.plugin.known} | dict(self.values)
        plain = (bool, int, float, str, type(None))
        return {key: value if isinstance(value, plain) else self._text(key) for key, value in found.items()}

    def _text(self, key: str) -> str:
        if self.plugin.known[key].parse is not None:
            return self.texts[key].replace(",", _NESTED_COMMA)
        return show(self.values[key])


class PluginTable:
    """The plug-ins of one kind by name: those of a dict, then installed ones.

    Args:
        kind: what they are, ``matcher``; the name of the setting that chooses one.
        own: name -> what comes with mvcodec. It may change.
        group: of entry points; None: other packages bring none.
    """

    def __init__(self, kind: str, own: Mapping[str, Plugin], group: str | None = None) -> None:
        self.kind, self.own, self.group = kind, own, group

    def choose(self, specification: str, setting: str = "") -> Chosen:
        """Read and check ``name:key=value,...``.

        Args:
            setting: what an error calls it; by default the kind.

        Raises:
            SettingError: no such name, or a setting that is unknown or outside its range.
            InputError: another package's plug-in does not load; the message names the package.
        """
        setting = setting or self.kind
        name, colon, rest = specification.partition(":")
        plugin = self._find(name, setting)
        texts: dict[str, str] = {}
        for word in rest.split(",") if colon else ():
            key, equals, text = word.partition("=")
            if not equals or key in texts:
                found = f"{key!r} twice" if equals else repr(word)
                raise SettingError(f"{setting} {name}", found, "key=value, each key once, between commas")
            texts[key] = text
        known, values = plugin.known, {}
        for key, text in texts.items():
            if key not in known:
                choices = ", ".join(known) or "none: it has no settings"
                expected = f"{choices}{did_you_mean(key, known)}"
                raise SettingError(f"{setting} {name}", f"no setting {key!r}", expected)
            given = text.replace(_NESTED_COMMA, ",") if known[key].parse is not None else text
            values[key] = known[key].read(given, f"{setting} {name}:{key}")
        return Chosen(name, plugin, texts, values)

    def sources(self) -> Iterator[tuple[str, str]]:
        """(name, distribution) of every plug-in; nothing is loaded. Names that are taken are warned of."""
        yield from ((name, OWN_SOURCE) for name in self.own)
        installed = self._installed()
        for entry in self._entries:
            if installed.get(entry.name) is not entry:
                text = f"{_distribution(entry)}: its {self.kind} {entry.name} is ignored, the name is taken"
                warnings.warn(text, MvCodecWarning, stacklevel=2)
        yield from ((name, _distribution(entry)) for name, entry in installed.items())

    def load(self, name: str) -> Plugin:
        """The plug-in of a name that `sources` gave.

        Raises:
            InputError: it does not load; the message names the package.
        """
        return self.own[name] if name in self.own else _loaded(self._installed()[name])

    def _find(self, name: str, setting: str) -> Plugin:
        if name in self.own:
            return self.own[name]
        installed = self._installed()
        if name in installed:
            return _loaded(installed[name])
        names = [*self.own, *installed]
        raise SettingError(
            setting, name or "nothing", f"one of {', '.join(names)}{did_you_mean(name, names)}"
        )

    def _installed(self) -> dict[str, EntryPoint]:
        """By name; mvcodec's own names stay what they are, and of two others the first one counts."""
        found: dict[str, EntryPoint] = {}
        for entry in self._entries:
            if entry.name not in self.own:
                found.setdefault(entry.name, entry)
        return found

    @cached_property
    def _entries(self) -> tuple[EntryPoint, ...]:
        from importlib.metadata import entry_points

        return tuple(entry_points(group=self.group)) if self.group else ()


def _loaded(entry: EntryPoint) -> Plugin:
    try:
        found = entry.load()
    except Exception as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise _broken(entry, f"that does not load ({reason})") from None
    if isinstance(found, Plugin):
        return found
    if not callable(found):
        raise _broken(entry, f"that is a {type(found).__name__}")
    help_text = (found.__doc__ or "").partition("\n")[0].strip().rstrip(".")
    if isinstance(found, type) and is_dataclass(found):
        return Plugin(lambda made: made, found, help_text)
    return Plugin(found, None, help_text)


def _broken(entry: EntryPoint, what: str) -> InputError:
    expected = "a class, a function without arguments, or a mvcodec.Plugin"
    return InputError(_distribution(entry), f"the entry point {entry.name} = {entry.value} {what}", expected)


def _distribution(entry: EntryPoint) -> str:
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else "an unknown package"
