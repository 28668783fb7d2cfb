"""Headers by which a browser protects the pages, and what it says of where a request comes from."""

from urllib.parse import urlsplit

__all__ = ["ENCRYPTED_ONLY", "OF_LOG_IN", "OF_PAGES", "host_of", "is_own_origin", "own_path"]

_BASE = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    # Not no-referrer, with which a form's own origin would be "null".
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=(), payment=(), usb=()",
    "Cache-Control": "no-store",
}
_NO_FRAMES = "frame-ancestors 'none'; base-uri 'none'; form-action 'self'"

OF_PAGES = {
    **_BASE,
    # NiceGUI's page has scripts and styles in its text and evaluates what the server sends, so
    # both must be allowed; nothing is loaded from, or sent to, another host.
    "Content-Security-Policy": "default-src 'self'; "
    "script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; "
    f"connect-src 'self'; object-src 'none'; {_NO_FRAMES}",
}
"""Of the pages and their files, where they have none of their own."""

ENCRYPTED_ONLY = {"Strict-Transport-Security": "max-age=86400"}
"""With a certificate: a browser that has been here comes by https alone for a day."""

OF_LOG_IN = {
    **_BASE,
    "Content-Security-Policy": f"default-src 'none'; style-src 'unsafe-inline'; {_NO_FRAMES}",
}
"""Of the page of the log-in, which holds no script."""


def host_of(header: str) -> str:
    """Return the name or address in a header ``Host``; empty if there is none."""
    try:
        return urlsplit(f"//{header}").hostname or ""
    except ValueError:
        return ""


def is_own_origin(origin: str | None, host: str, is_encrypted: bool = False) -> bool:
    """Tell whether a request comes from a page of the host that is asked.

    A browser says the origin of each WebSocket and each form; what says none is no browser. With a
    certificate the page came by https; without one it may have too, from a proxy.
    """
    if origin is None:
        return True
    try:
        asking = urlsplit(origin)
        schemes = ("https",) if is_encrypted else ("http", "https")
        is_here = bool(host) and asking.netloc.lower() == host.lower()
        return is_here and asking.scheme in schemes
    except ValueError:
        return False


def own_path(text: str) -> str:
    """Return a path of this host, or ``/`` where the text may lead to another one."""
    is_own = text.startswith("/") and not text.startswith("//")
    return text if is_own and text.isprintable() and "\\" not in text else "/"
