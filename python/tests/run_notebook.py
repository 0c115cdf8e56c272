"""Runs a notebook in an empty folder: `run_notebook.py NOTEBOOK`. Fails where a cell does."""

import sys
import tempfile

import nbclient
import nbformat

with tempfile.TemporaryDirectory() as folder:
    notebook = nbformat.read(sys.argv[1], as_version=4)
    if any(cell.get("outputs") for cell in notebook.cells):
        sys.exit(f"{sys.argv[1]} has outputs: clear them before it is committed")
    nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": folder}}).execute()
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            print(output.get("text") or output.get("data", {}).get("text/plain", ""), end="")
    shown = [output for cell in notebook.cells for output in cell.get("outputs", []) if "text/html" in output.get("data", {})]
    if not shown:
        sys.exit("no cell showed a page")
