"""Runs as pandas data frames and as Parquet."""

from __future__ import annotations

from collections.abc import Callable
from typing import IO, TYPE_CHECKING, Any

from rcilab.core.optional_deps import require_library
from rcilab.recording.columns import facts_text, run_columns, run_facts

if TYPE_CHECKING:
    from rcilab.recording.run import Run


def to_pandas(run: Run) -> Any:
    """Returns a `pandas.DataFrame` indexed by t; `.attrs` has "units" by column and "run", the facts of the run.

    Raises:
        UsageError: pandas is not installed.
    """
    pandas = require_library("pandas", "to_pandas()")
    columns = run_columns(run)
    frame = pandas.DataFrame({column.name: column.values for column in columns}).set_index("t")
    frame.attrs = {"units": {column.name: column.unit for column in columns}, "run": run_facts(run)}
    return frame


def write_parquet(run: Run, stream: IO[bytes], progress: Callable[[float], None]) -> None:
    """Writes the columns as Parquet; units are metadata of the columns ("unit"), the facts of the run ("rcilab").

    Raises:
        UsageError: pyarrow is not installed.
    """
    arrow = require_library("pyarrow", "Parquet")
    parquet = require_library("pyarrow.parquet", "Parquet")
    columns = run_columns(run)
    arrays = [arrow.array(column.values) for column in columns]
    fields = [
        arrow.field(column.name, array.type, metadata={"unit": column.unit})
        for column, array in zip(columns, arrays, strict=True)
    ]
    progress(0.3)
    schema = arrow.schema(fields, metadata={"rcilab": facts_text(run)})
    parquet.write_table(arrow.Table.from_arrays(arrays, schema=schema), stream, compression="zstd")
