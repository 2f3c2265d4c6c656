"""A worker keeps its stdin to itself: on Windows, libraries that ask for it would wait while it is read."""

import json
import pickle
import subprocess
import sys
from pathlib import Path

SCRIPT = """
import os
from fiveaxis.job.batch import worker

class Answer:
    def as_dict(self):
        return {"read": len(os.read(0, 1))}

worker.run_queued = lambda *_: Answer()
worker.main()
"""


def test_a_job_finds_an_empty_stdin_while_the_next_task_is_waited_for():
    pipes = dict(stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    with subprocess.Popen([sys.executable, "-c", SCRIPT], **pipes) as process:
        pickle.dump(("task", Path()), process.stdin)
        process.stdin.flush()
        messages = [json.loads(process.stdout.readline()) for _ in range(2)]
        process.stdin.close()
    assert messages[1] == {"row": {"read": 0}}
    assert process.returncode == 0
