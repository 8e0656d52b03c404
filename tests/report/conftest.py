"""Pictures that tests draw are in matplotlib's own style, whatever a matplotlibrc asks for."""

from pathlib import Path

import matplotlib as mpl
import pytest

mpl.rcdefaults()


@pytest.fixture
def no_room_for(monkeypatch):
    """Let the disk be full for files of an ending, from a call on."""
    write_bytes = Path.write_bytes

    def fill(ending):
        def full(path, content):
            if path.suffix == ending:
                raise OSError(28, "No space left on device")
            return write_bytes(path, content)

        monkeypatch.setattr(Path, "write_bytes", full)

    return fill
