"""What went wrong, as a message: in the words of the catalogues where the error says which."""

from __future__ import annotations

from rcilab.errors import RcilabError
from rcilab.words.text import Finished, Message, Remark, message

_NAMES = frozenset({"status", "kind"})
"""Facts that are names with words of their own: the answer to a command, the type of a waypoint."""


def tell(error: RcilabError) -> Message | Finished:
    """Returns an error for a face to say; one without a code keeps its English sentence, in the units of the face."""
    if not error.code:
        return Finished(str(error))
    facts = {name: tell(fact) if isinstance(fact, RcilabError) else fact for name, fact in error.facts.items()}
    for name in _NAMES & facts.keys():
        facts[name] = message(f"{name}.{str(facts[name]).replace(' ', '_')}")
    return message(f"error.{error.code}", **facts)


def tell_note(note: str) -> Message | Finished:
    """Returns what a planner has to say about its motion; a note without a code keeps its English sentence."""
    if isinstance(note, Remark) and note.code:
        return message(f"remark.{note.code}", **note.facts)
    return Finished(note)
