"""Independent generator of recordings with concealed effects (see README.md)."""
