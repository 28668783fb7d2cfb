"""Where alerts go, and by what they are known to be genuine."""

import contextlib
import hashlib
import hmac
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from urllib.parse import urlsplit

from valve_friction_ros.loopback import is_loopback

__all__ = ["SIGNATURE", "URL_VARIABLE", "Place", "Secrets", "Webhook", "signature"]

SIGNATURE = "X-Valve-Friction-Signature"
"""Header with the signature."""

URL_VARIABLE = "VALVE_FRICTION_WEBHOOK_URL"
"""Variable of the environment with the address that the token is for."""
_SECRET = "VALVE_FRICTION_WEBHOOK_SECRET"  # noqa: S105 - the name of a variable
_TOKEN = "VALVE_FRICTION_WEBHOOK_TOKEN"  # noqa: S105

Place = tuple[str, str, int]
"""Scheme, host and port."""

_PORTS = {"https": 443, "http": 80}


@dataclass(frozen=True)
class Webhook:
    """The address of a webhook.

    As text it has neither path nor query, which hold secrets of many services.

    Attributes
    ----------
    scheme : str
        ``https``, or ``http`` to this machine.
    host : str
        Name or address.
    port : int
        Its port.
    target : str
        Path and query.
    """

    scheme: str
    host: str
    port: int
    target: str = field(repr=False)

    @classmethod
    def at(cls, url: str, name: str = "webhook_url") -> "Webhook":
        """Read the address of a webhook; `name` is what errors call it.

        Raises ValueError, without the address, if it is none, is not encrypted on its way to
        another machine, or holds a name or a password.
        """
        if not url.isascii() or not url.isprintable() or " " in url:
            raise ValueError(f"{name} has a space, or a character that is not ASCII: encode it")
        try:
            parts = urlsplit(url)
            host, port = parts.hostname, parts.port
        except ValueError:
            host = port = None
        if not host or parts.scheme not in _PORTS:
            raise ValueError(f"{name} is no address: write https://host/path")
        if parts.username is not None or parts.password is not None:
            raise ValueError(
                f"{name} holds a name or a password, which everybody on the ROS graph can "
                f"read: put a token into the environment variable {_TOKEN}"
            )
        if parts.scheme == "http" and not is_loopback(host):
            raise ValueError(
                f"{name} is http to another machine, where everybody on the way can read and "
                "change it: write https, or name a relay on this machine"
            )
        target = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
        return cls(parts.scheme, host, _PORTS[parts.scheme] if port is None else port, target)

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] = os.environ) -> "Webhook | None":
        """Read ``VALVE_FRICTION_WEBHOOK_URL``, if it is set; raises ValueError like `at`."""
        url = environment.get(URL_VARIABLE, "").strip()
        return cls.at(url, URL_VARIABLE) if url else None

    @property
    def place(self) -> Place:
        """Its host."""
        return self.scheme, self.host, self.port

    @property
    def is_encrypted(self) -> bool:
        """Whether alerts go there by TLS."""
        return self.scheme == "https"

    @property
    def is_here(self) -> bool:
        """Whether it is on this machine."""
        return is_loopback(self.host)

    def __str__(self) -> str:
        """Return scheme, host and port."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}"


@dataclass(frozen=True)
class Secrets:
    """What the receiver of an alert knows its sender by; never shown.

    Attributes
    ----------
    secret : str
        Key of the signature; empty: no signature.
    token : str
        Bearer token, for the address in the environment alone; empty: none.
    """

    secret: str = field(default="", repr=False)
    token: str = field(default="", repr=False)

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] = os.environ) -> "Secrets":
        """Read ``VALVE_FRICTION_WEBHOOK_SECRET`` and ``VALVE_FRICTION_WEBHOOK_TOKEN``.

        Raises ValueError, without the token, if it cannot stand in a header.
        """
        secret, token = (environment.get(name, "").strip() for name in (_SECRET, _TOKEN))
        if not token.isascii() or (token and not token.isprintable()) or " " in token:
            raise ValueError(f"{_TOKEN} has a space, or a character that is not ASCII: correct it")
        return cls(secret, token)

    def going_to(self, webhook: Webhook, environment: Mapping[str, str] = os.environ) -> "Secrets":
        """Return what may go to a webhook: the token only to the address of the environment.

        Who may give a parameter is not always who may have the token. The key of the signature goes
        nowhere.
        """
        with contextlib.suppress(ValueError):
            if webhook == Webhook.from_environment(environment):
                return self
        return Secrets(self.secret)

    def headers(self, body: bytes, time: int) -> dict[str, str]:
        """Return the headers that vouch for a body sent at `time`, s since 1970."""
        headers = {}
        if self.secret:
            headers[SIGNATURE] = signature(self.secret, body, time)
        if self.token:
            headers["Authorization"] = f"Bearer {self.token}"
        return headers


def signature(secret: str, body: bytes, time: int) -> str:
    """Sign a body that is sent at `time`, s since 1970 (UTC).

    It is ``t=time,v1=digest``, the digest HMAC-SHA256 of time, a full stop and the body, in
    hexadecimal digits. A receiver computes the same, compares in constant time, and refuses old
    times.
    """
    signed = f"{time}.".encode() + body
    return f"t={time},v1={hmac.new(secret.encode(), signed, hashlib.sha256).hexdigest()}"
