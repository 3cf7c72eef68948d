"""Adapters of engines: each a function `collide` of a file, which the interpreter of the engine runs."""
