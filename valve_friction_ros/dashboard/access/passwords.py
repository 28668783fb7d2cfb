"""Passwords, of which only a hash is kept.

scrypt (RFC 7914) is in Python's standard library and needs memory as well as time, so that a stolen
file cannot be tried quickly on graphics cards. Its cost is one of those that OWASP's *Password
Storage Cheat Sheet* gives as equal: N = 2¹⁴, r = 8, p = 5; 16 MiB and some 0.2 s a try.
"""

import base64
import binascii
import hashlib
import hmac
import secrets
import unicodedata
from dataclasses import dataclass, field, replace

__all__ = ["LONGEST", "SHORTEST", "HashedPassword"]

SHORTEST, LONGEST = 10, 200
"""Characters of a new password, and of one that is tried."""

_KIND = "scrypt"
_COST, _BLOCK, _PARALLEL = 14, 8, 5
_SALT, _DIGEST = 16, 32
_MOST_COST, _MOST_BLOCK, _MOST_PARALLEL = 20, 16, 16


def _encoded(data: bytes) -> str:
    return base64.urlsafe_b64encode(data).decode().rstrip("=")


def _decoded(text: str) -> bytes:
    return base64.b64decode(text + "=" * (-len(text) % 4), altchars=b"-_", validate=True)


@dataclass(frozen=True)
class HashedPassword:
    """A salted hash of a password.

    As text it is ``scrypt:14:8:5:SALT:DIGEST``, with the logarithm of N, r, p and two numbers in
    base64; no character of it means anything to a shell.

    Attributes
    ----------
    cost, block, parallel : int
        log₂ N, r and p of scrypt.
    salt, digest : bytes
        What was hashed with the password, and what came out.

    Raises
    ------
    ValueError
        If the cost is not one that a log-in can bear, or salt or digest are too short.
    """

    cost: int
    block: int
    parallel: int
    salt: bytes = field(repr=False)
    digest: bytes = field(repr=False)

    def __post_init__(self) -> None:
        """Refuse what is no hash, or would take a machine's memory."""
        if not (
            10 <= self.cost <= _MOST_COST
            and 1 <= self.block <= _MOST_BLOCK
            and 1 <= self.parallel <= _MOST_PARALLEL
            and len(self.salt) >= _SALT
            and len(self.digest) >= _DIGEST
        ):
            raise ValueError("no usable hash of a password")

    @classmethod
    def of(cls, password: str) -> "HashedPassword":
        """Hash a new password with a salt of its own.

        Raises ValueError if it is shorter than `SHORTEST` or longer than `LONGEST` characters.
        """
        if not SHORTEST <= len(password) <= LONGEST:
            raise ValueError(
                f"a password has {SHORTEST} to {LONGEST} characters, this one {len(password)}"
            )
        salt = secrets.token_bytes(_SALT)
        empty = cls(_COST, _BLOCK, _PARALLEL, salt, bytes(_DIGEST))
        return cls(_COST, _BLOCK, _PARALLEL, salt, empty._hashed(password))

    @classmethod
    def unknown(cls, like: "HashedPassword | None" = None) -> "HashedPassword":
        """Return a hash that no password has; it takes as long as another, or as a new one."""
        salt, digest = secrets.token_bytes(_SALT), secrets.token_bytes(_DIGEST)
        if like is not None:
            return replace(like, salt=salt, digest=digest)
        return cls(_COST, _BLOCK, _PARALLEL, salt, digest)

    @classmethod
    def read(cls, text: str) -> "HashedPassword":
        """Read the text of a hash; raises ValueError, without the text, if it is none."""
        kind, *rest = text.split(":")
        try:
            if kind != _KIND:
                raise ValueError
            cost, block, parallel, salt, digest = rest
            return cls(int(cost), int(block), int(parallel), _decoded(salt), _decoded(digest))
        except (ValueError, binascii.Error):
            raise ValueError(
                "no usable hash of a password: make one by `valve_friction dashboard-account`"
            ) from None

    def __str__(self) -> str:
        """Return the text that `read` reads."""
        numbers = f"{self.cost}:{self.block}:{self.parallel}"
        return f"{_KIND}:{numbers}:{_encoded(self.salt)}:{_encoded(self.digest)}"

    def matches(self, password: str) -> bool:
        """Tell whether a password has this hash, in a time that says nothing of the digest."""
        return hmac.compare_digest(self._hashed(password[:LONGEST]), self.digest)

    def _hashed(self, password: str) -> bytes:
        # Keyboards differ in how they write an accented letter: NFKC is the one form of it.
        return hashlib.scrypt(
            unicodedata.normalize("NFKC", password).encode(errors="surrogatepass"),
            salt=self.salt,
            n=1 << self.cost,
            r=self.block,
            p=self.parallel,
            maxmem=256 * self.block * (self.parallel + (1 << self.cost)),
            dklen=len(self.digest),
        )
