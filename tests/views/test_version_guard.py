"""A viser whose internals are unknown is refused in words."""

from __future__ import annotations

import pytest
import viser

from rcilab.core.errors import UsageError
from rcilab.views.viser_ext.version_guard import require_known_viser


def test_only_a_known_viser_is_patched(monkeypatch: pytest.MonkeyPatch) -> None:
    require_known_viser()
    monkeypatch.setattr(viser, "__version__", "1.2.0")
    with pytest.raises(UsageError, match=r"viser 1\.2\.0 is installed, but rcilab needs viser 1\.1\.x"):
        require_known_viser()
