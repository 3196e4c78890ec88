# SPDX-License-Identifier: Apache-2.0
"""_call.py NAME: the program of a method that is a Python function. Asks the process that runs the experiment for the
image, through the socket that COVARY_METHODS names. Imports nothing that takes time, which would be the method's."""
import json
import os
import socket
import sys

with socket.socket(socket.AF_UNIX) as connection:
    connection.connect(os.environ["COVARY_METHODS"])
    run = {name: value for name, value in os.environ.items() if name.startswith("COVARY_")}
    connection.sendall(json.dumps({"name": sys.argv[1], "run": run}).encode() + b"\n")
    answer = json.loads(connection.makefile("rb").read())
print("processor_seconds", answer.get("processor_seconds", 0))  # of the other process
sys.exit(answer.get("error"))
