"""What the tables of a scene have in common."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from contact.scene.expression import Expression

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Number = Annotated[float, Field(allow_inf_nan=False)]
Vector = Annotated[list[Number], Field(min_length=1, max_length=3)]
Function = Callable[..., Any]
Value = Number | str | Function
Name = Annotated[str, Field(min_length=1)]


class Table(BaseModel):
    """A table of a scene: typed, frozen, and without keys that nobody reads."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, arbitrary_types_allowed=True)


def check_value(value: Any) -> Any:
    """A value or list of values; ValueError for a text that is no expression."""
    parts = value if isinstance(value, list) else [value]
    for part in parts:
        if isinstance(part, str):
            Expression(part)
    return value
