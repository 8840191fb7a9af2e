"""Quarantine: the matches and recordings that a stage refused, and the reasons."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from pitchlore.pipeline.base.errors import CorruptFile, PitchloreError, StorageFailed, in_one_line
from pitchlore.pipeline.store.files import Files
from pitchlore.pipeline.store.paths import listed, safe
from pitchlore.pipeline.store.receipts import Quarantined
from pitchlore.pipeline.store.sealed import read_model, sealed


class Quarantine(Files):
    """Records of refused matches and recordings; the files themselves are not touched."""

    def quarantine(self, noun: str, name: str, error: Exception) -> None:
        """Record why a stage refused a match; the match's files are not touched.

        On a full disk nothing is recorded: the error itself, which the caller raises, says more than that.
        """
        record = Quarantined(noun=noun, name=name, error=type(error).__name__, reason=in_one_line(error))
        with suppress(StorageFailed):
            self.keep(self._quarantine_path(noun, name), sealed(record))

    def offer(self, name: str, error: Exception) -> None:
        """Write the map that a refusal brings along, and say where it is: in the folder ``maps``."""
        if isinstance(error, PitchloreError) and error.offer:
            path = self.root / "maps" / f"{safe(name)}.toml"
            with suppress(StorageFailed):
                self.write_bytes(path, error.offer.encode())
                error.next_step += f". A map to mend was written for it: --map {self.named(path)}"

    def release(self, noun: str, name: str) -> None:
        """Delete a record, because the stage now accepts the match."""
        path = self._quarantine_path(noun, name)
        if path.exists():
            self.drop(path)

    def quarantined(self) -> list[Quarantined]:
        """All that is in quarantine, in order of stage and name. Of a damaged record only these are known."""
        found = []
        for path in listed(self.root / "quarantine", ".json"):
            try:
                record = read_model(path, Quarantined)
            except CorruptFile as error:
                noun, _, name = Path(path).stem.partition(".")
                record = Quarantined(noun=noun, name=name, error="CorruptFile", reason=str(error))
            if record is not None:
                found.append(record)
        return found

    def _quarantine_path(self, noun: str, name: str) -> Path:
        return self.root / "quarantine" / f"{safe(noun)}.{safe(name)}.json"
