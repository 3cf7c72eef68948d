"""What an engine delivers: a fixed set of collisions, the checks of its answers, and adapters of engines."""
