from __future__ import annotations

import sys

import pytest

import rcilab
from rcilab.core.errors import UsageError
from rcilab.core.optional_deps import require_installed


def test_an_installed_package_is_no_matter_for_words() -> None:
    require_installed("numpy", "everything")


def test_a_missing_package_is_named_with_the_way_to_get_it() -> None:
    with pytest.raises(UsageError, match=r"plot needs no_such_package.*pip install 'rcilab\[lab\]'"):
        require_installed("no_such_package", "plot")


def test_plot_without_matplotlib_is_refused_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    model = rcilab.load_model("xMate3")
    with pytest.raises(UsageError, match="plot needs matplotlib"):
        rcilab.plot(rcilab.plan_joint(model, model.home, model.home + 0.1), model)
