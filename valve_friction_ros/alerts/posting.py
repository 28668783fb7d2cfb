"""One try to deliver an alert: bounded in time and memory, whatever the other side does."""

import base64
import contextlib
import http.client
import socket
import ssl
import threading
import time
from types import TracebackType
from urllib.parse import SplitResult, unquote, urlsplit
from urllib.request import getproxies, proxy_bypass

from valve_friction_ros.alerts.webhook import Secrets, Webhook

__all__ = ["DeliveryError", "post"]

_RETRIED = frozenset({408, 425, 429})
"""Answers beside 5xx after which a later try may succeed: time-out, too early, too many."""


class DeliveryError(Exception):
    """An alert was not delivered; the message says why, without any secret.

    Attributes
    ----------
    is_final : bool
        Whether another try would end alike, until somebody changes something.
    is_answered : bool
        Whether the host has answered; else the next letter to it would fare alike.
    """

    def __init__(self, cause: str, is_final: bool = False, is_answered: bool = True) -> None:
        super().__init__(cause)
        self.is_final = is_final
        self.is_answered = is_answered


class _Connection(http.client.HTTPConnection):
    """A connection that ends after a time, also while it is being made."""

    def __init__(self, webhook: Webhook, limit: float) -> None:
        proxy = None if webhook.is_here else _proxy(webhook.host)
        if proxy is None:
            super().__init__(webhook.host, webhook.port, timeout=limit)
        else:
            super().__init__(proxy.hostname or "", proxy.port or 80, timeout=limit)
            self.set_tunnel(webhook.host, webhook.port, _authorization(proxy.netloc))
        self.default_port = 443 if webhook.is_encrypted else 80  # so that Host is short
        self._tls_name = webhook.host if webhook.is_encrypted else None
        self._is_late = False
        self._end = threading.Timer(limit, self._cut)
        self._end.daemon = True

    def __enter__(self) -> "_Connection":
        self._end.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._end.cancel()
        self.close()

    def _cut(self) -> None:
        self._is_late = True
        with contextlib.suppress(
            OSError, AttributeError, TypeError
        ):  # not connected yet, or closed
            # That of SSLSocket would take the encryption away from under the other thread.
            socket.socket.shutdown(self.sock, socket.SHUT_RDWR)

    def require_time(self) -> None:
        """Raise TimeoutError if its time is over: what it has read may be a part."""
        if self._is_late:
            raise TimeoutError

    def connect(self) -> None:
        super().connect()
        if self._tls_name is not None:
            context = ssl.create_default_context()
            self.sock = context.wrap_socket(
                self.sock, server_hostname=self._tls_name, do_handshake_on_connect=False
            )
            self.require_time()
            self.sock.do_handshake()
        self.require_time()

    @property
    def is_late(self) -> bool:
        """Whether it was ended because its time was over."""
        return self._is_late


def _proxy(host: str) -> SplitResult | None:
    address = getproxies().get("https")
    if not address or proxy_bypass(host):
        return None
    return urlsplit(address if "://" in address else f"http://{address}")


def _authorization(place: str) -> dict[str, str]:
    user, at, _ = place.rpartition("@")
    if not at:
        return {}
    return {"Proxy-Authorization": f"Basic {base64.b64encode(unquote(user).encode()).decode()}"}


def post(webhook: Webhook, body: bytes, secrets: Secrets, limit: float = 10.0) -> None:
    """Post a JSON body to a webhook, within `limit` seconds and the look-up of its name.

    Of the answer only status line and headers are read, which ``http.client`` bounds; a redirect
    is not followed. Certificate and host name are verified, by the authorities of the system or
    of ``SSL_CERT_FILE``. A proxy is used where ``https_proxy`` names one, and ``no_proxy`` does not
    exempt the host; never for this machine.

    Raises
    ------
    DeliveryError
        Unless the answer is a success (2xx).
    """
    headers = {
        "Content-Type": "application/json",
        "User-Agent": "valve_friction_ros",
        "Connection": "close",
        **secrets.headers(body, int(time.time())),
    }
    try:
        with _Connection(webhook, limit) as connection:
            try:
                connection.request("POST", webhook.target, body, headers)
                with connection.getresponse() as response:
                    status = response.status
                connection.require_time()
            except (OSError, http.client.HTTPException, ValueError) as error:
                raise _delivery_error(webhook, error, connection.is_late, limit) from None
    except ValueError:  # the port of a proxy
        raise DeliveryError(
            "the proxy of the environment is no address: correct it", True
        ) from None
    if not 200 <= status < 300:
        is_redirect = 300 <= status < 400
        raise DeliveryError(
            f"{webhook} answered {status}"
            + (", and redirects are not followed: name the final address" if is_redirect else ""),
            is_final=status < 500 and status not in _RETRIED,
        )


def _delivery_error(
    webhook: Webhook, error: Exception, is_late: bool, limit: float
) -> DeliveryError:
    if is_late or isinstance(error, TimeoutError):
        return DeliveryError(f"{webhook} has not answered within {limit:g} s", is_answered=False)
    if isinstance(error, ssl.SSLCertVerificationError):
        return DeliveryError(
            f"the certificate of {webhook} is not trusted: {error.verify_message}: correct the "
            "server, or name its authority's file in SSL_CERT_FILE",
            is_final=True,
        )
    if isinstance(error, OSError):
        cause = error.strerror or type(error).__name__
        return DeliveryError(f"{webhook}: {cause}", is_answered=False)
    return DeliveryError(f"{webhook} answered no HTTP ({type(error).__name__})")
