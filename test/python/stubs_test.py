"""The checked-in type stub says what the compiled module has: names, members, parameters."""
import ast
import os
import pathlib
import re
import unittest

from depthservo import _core

TREE = ast.parse(pathlib.Path(os.environ["DEPTHSERVO_STUBS"], "_core.pyi").read_text())


def parameters(node):
    return [a.arg for a in node.args.posonlyargs + node.args.args + node.args.kwonlyargs if a.arg not in ("self", "cls")]


def of_docstring(function):
    """Names of parameters as pybind11 has them in the first line of the docstring."""
    line = (function.__doc__ or "").splitlines()[0]
    return [name for name in re.findall(r"[(,] ?(\w+): ", re.sub(r"\[[^][]*\]|<[^<>]*>", "", re.sub(r"\[[^][]*\]", "", line)))
            if name != "self"]


class Stubs(unittest.TestCase):
    def test_names(self):
        stated = {n.name for n in TREE.body if isinstance(n, (ast.ClassDef, ast.FunctionDef))}
        stated |= {n.target.id for n in TREE.body if isinstance(n, ast.AnnAssign)}
        there = {n for n in dir(_core) if not n.startswith("__") or n == "__version__"}
        self.assertEqual(stated, there)

    def test_members(self):
        for node in TREE.body:
            if not isinstance(node, ast.ClassDef):
                continue
            stated = {n.name for n in node.body if isinstance(n, ast.FunctionDef)}
            stated |= {n.target.id for n in node.body if isinstance(n, ast.AnnAssign)}
            there = {n for n, v in vars(getattr(_core, node.name)).items()
                     if not n.startswith("__") or n in ("__len__", "__repr__") or (n == "__init__" and "__init__" in stated)}
            there.discard("_pybind11_conduit_v1_")
            self.assertEqual(stated, there, node.name)

    def test_parameters(self):
        compared = 0
        for node in TREE.body:
            owner = [(node, getattr(_core, node.name))] if isinstance(node, ast.FunctionDef) else []
            if isinstance(node, ast.ClassDef):
                owner = [(n, getattr(getattr(_core, node.name), n.name)) for n in node.body
                         if isinstance(n, ast.FunctionDef) and n.name not in ("__len__", "__repr__")
                         and not n.decorator_list]
            for stated, there in owner:
                if there.__doc__ and "(" in there.__doc__.splitlines()[0]:
                    self.assertEqual(parameters(stated), of_docstring(there), stated.name)
                    compared += 1
        self.assertGreater(compared, 30)


if __name__ == "__main__":
    unittest.main()
