"""Config blocks of the identification methods, loaded lazily."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from biogrip.identify.methods import METHODS, block_class
from biogrip.keys import Problem
from biogrip.study.typed import built


@dataclass(frozen=True)
class MethodBlocks:
    """Settings of the methods, constructed on access, so that unused methods are not imported.

    Parameters
    ----------
    plain
        Plain config of each block.
    """

    plain: Mapping[str, Mapping[str, Any]]

    @staticmethod
    def classes() -> dict[str, type]:
        """Return the settings class of each block, importing all methods."""
        names = [name for method in METHODS.values() for name in method.blocks]
        return {name: block_class(name) for name in names}

    def block(self, name: str) -> object:
        """Return the settings object of a block."""
        return built(block_class(name), self.plain.get(name, {}))

    def of(self, method: str) -> object:
        """Return the settings object of a method."""
        found = [self.block(name) for name in METHODS[method].blocks]
        combined = METHODS[method].settings
        return METHODS[method].named(combined)(*found) if combined else found[0]

    def problems_of(self, genes: int) -> Iterator[Problem]:
        """Find settings that conflict with the length of a chromosome."""
        for name in self.classes():
            settings = self.block(name)
            if hasattr(settings, "problems_of"):
                for path, text in settings.problems_of(genes):
                    yield (name, *path), text
