"""The stages, a module or folder a noun. No stage imports another, but for ``sequences`` and ``sides``."""
