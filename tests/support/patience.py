"""How long tests wait for other processes and threads.

No busy machine is that slow, so what takes longer stands still. A test that passes waits no longer than it
must.
"""

PATIENCE = 600.0  # s
