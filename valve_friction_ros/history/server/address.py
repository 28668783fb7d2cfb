"""The address of a history on a server."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from urllib.parse import parse_qsl, unquote, urlsplit

__all__ = ["INSTALL", "URL_VARIABLE", "HistoryServer", "is_url", "server_from"]

URL_VARIABLE = "VALVE_FRICTION_HISTORY_URL"
"""The variable of the environment that names the server, also with a password."""

INSTALL = "psycopg is missing: pip install 'psycopg[binary]>=3.2,<4'"
"""What installs the library that speaks to a server."""

_SCHEMES = ("postgresql", "postgres")
_HIDDEN = "***"


def is_url(text: str) -> bool:
    """Return whether a text is the address of a server, and no path."""
    return text.partition("://")[0].lower() in _SCHEMES and "://" in text


@dataclass(frozen=True)
class HistoryServer:
    """A history in PostgreSQL.

    As text it has user, host and database, and nothing that may be secret.

    Attributes
    ----------
    url : str
        Address as PostgreSQL's own clients read it: ``postgresql://user@host/database``, with
        their parameters such as ``?sslmode=verify-full``.
    """

    url: str = field(repr=False)

    def __post_init__(self) -> None:
        """Refuse an address that is none, without repeating it."""
        if not is_url(self.url) or not self.url.isprintable() or " " in self.url:
            raise ValueError("no address of a server: write it as postgresql://user@host/database")
        try:
            urlsplit(self.url)
        except ValueError:
            raise ValueError(
                "the address of the server cannot be read: encode special characters of the "
                "password, or put it into ~/.pgpass"
            ) from None

    def __str__(self) -> str:
        """Return it without password and parameters."""
        parts = urlsplit(self.url)
        user, at, hosts = parts.netloc.rpartition("@")
        name = user.partition(":")[0]
        return f"postgresql://{name}{at}{hosts}{parts.path}"

    @property
    def secrets(self) -> tuple[str, ...]:
        """The passwords in it, as they are written and as they are meant."""
        parts = urlsplit(self.url)
        written = [parts.netloc.rpartition("@")[0].partition(":")[2]]
        pairs = [one.partition("=") for one in parts.query.split("&")]
        written += [value for name, _, value in pairs if "password" in name.lower()]
        meant = [value for name, value in parse_qsl(parts.query) if "password" in name.lower()]
        found = {*written, *map(unquote, written), *meant}
        return tuple(sorted(filter(None, found), key=len, reverse=True))

    def without_secrets(self, text: str) -> str:
        """Return a text in one line, without the password of this address."""
        for secret in (self.url, *self.secrets):
            text = text.replace(secret, _HIDDEN)
        return " ".join(text.split())


def server_from(
    url: str, name: str = "history_url", environment: Mapping[str, str] = os.environ
) -> HistoryServer | None:
    """Return the server of a parameter of this `name`, else of the environment; None for none.

    Raises ValueError, without the address, if it is none, or if the parameter holds a password.
    """
    url = url.strip()
    place = name if url else URL_VARIABLE
    url = url or environment.get(URL_VARIABLE, "").strip()
    if not url:
        return None
    try:
        server = HistoryServer(url)
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from None
    if place == name and server.secrets:
        raise ValueError(
            f"{name} holds a password, which everybody on the ROS graph can read: put it into "
            f"~/.pgpass or PGPASSWORD, or the whole address into {URL_VARIABLE}"
        )
    return server
