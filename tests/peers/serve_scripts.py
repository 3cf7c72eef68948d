"""Run scripts in forks of a process that has imported what they import: `PROGRAM serve_scripts.py MODULES`.

`tests.fork_server.run_script_in_fork` is the client.
"""

# what YADE has for its scripts; in Python, none
names = {name: value for name, value in globals().items() if not name.startswith("__")}

import sys  # noqa: E402
from importlib import import_module  # noqa: E402
from pathlib import Path  # noqa: E402

folder = Path(sys.argv[0]).absolute().parent
sys.path[:0] = [str(folder), str(folder.parents[1])]
from tests.fork_server import serve  # noqa: E402

for module in sys.argv[1:]:
    import_module(module)
serve(lambda: None)
