"""Parts of `identify-folder`."""
