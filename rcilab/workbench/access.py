"""The token of the page: generated here, or given where no other user of the machine can read it.

Never on a command line, which every local user can read.
"""

from __future__ import annotations

import os
import secrets
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import NamedTemporaryFile

from rcilab.core.atomic_file import read_own_text
from rcilab.core.errors import UsageError
from rcilab.views.access_control import is_loopback

VARIABLE = "RCILAB_TOKEN"
SHORTEST = 16  # Characters: 16 random letters cannot be guessed.
_BYTES = 24  # Random bytes of a generated token: 32 URL-safe characters.

_REDIRECT = """<!DOCTYPE html><meta charset="utf-8"><title>rcilab</title>
<meta http-equiv="refresh" content="0; url={url}"><a href="{url}">rcilab workbench</a>
"""


def require_token(token: str, where: str) -> str:
    """Returns a token after its check.

    Raises:
        UsageError: It is too short, or contains characters that cannot be typed.
    """
    if len(token) < SHORTEST:
        raise UsageError(f"the token in {where} has {len(token)} characters; give it at least {SHORTEST}")
    if not token.isprintable():
        raise UsageError(f"the token in {where} holds characters that cannot be printed; use letters and digits")
    return token


def find_token(
    host: str, *, is_private: bool = False, file: Path | None = None, environ: Mapping[str, str] = os.environ
) -> str | None:
    """Returns the token that pages must send: the given one, else a new one if one is needed, else None.

    Args:
        host: Address to listen on; a token is needed on any but loopback.
        is_private: Whether one is needed on loopback, too, where every account of this machine could open the page.
        file: File with the token in its first line.
        environ: May contain it as RCILAB_TOKEN; the file takes precedence.

    Raises:
        UsageError: The token is too short or can be read by others, or the host is not an address.
    """
    if file is not None:
        return _token_in(file)
    if environ.get(VARIABLE):
        return require_token(environ[VARIABLE], VARIABLE)
    return secrets.token_urlsafe(_BYTES) if is_private or not is_local(host) else None


def is_local(host: str) -> bool:
    """Returns whether only this machine can reach an address.

    Raises:
        UsageError: It is not an address of this machine.
    """
    try:
        return is_loopback(host)
    except (OSError, UnicodeError) as error:
        raise UsageError(f"--host {host} is not an address of this machine; leave it away for 127.0.0.1") from error


@contextmanager
def private_address(url: str) -> Iterator[str]:
    """Yields the address of a file that redirects a browser to `url`; only this user can read it, inside the block.

    A browser's address is on its command line, where a token must not be.
    """
    with NamedTemporaryFile("w", prefix="rcilab-", suffix=".html", encoding="utf-8") as file:  # Mode 0600.
        file.write(_REDIRECT.format(url=url))
        file.flush()
        yield Path(file.name).as_uri()


def _token_in(file: Path) -> str:
    try:
        mode = file.stat().st_mode
        lines = read_own_text(file).splitlines()
    except (OSError, UnicodeError) as error:
        raise UsageError(f"cannot read the token in {file}: {error}") from error
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise UsageError(f"others can read the token in {file}; run `chmod 600 {file}`")
    return require_token(lines[0].strip() if lines else "", str(file))
