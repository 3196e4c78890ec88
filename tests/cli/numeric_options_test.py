# SPDX-License-Identifier: Apache-2.0
"""Every option or parameter that takes a number refuses what is none, whatever else the command line says: they are
read from the help of each command and method, so a new one is tested as well."""
import re
import unittest

from cli_test import CliTest
from exr_writer import film

# What an argument of numbers is called, e.g. INT, X,Y,WIDTH,HEIGHT, LOW,HIGH, K/N, CRN:INDEPENDENT, relmse=X.
KINDS = re.compile(r"\b(U?INT|FLOAT|NUMBER|X|WIDTH|LOW|K/N|CRN:INDEPENDENT|SEEDS)\b|relmse=")
NO_NUMBERS = ("nan", "-inf", "1e999", "0x", "1.5.")
COMMANDS = {"render": ("scene.xml", "-o", "o.exr"), "probe": ("scene.xml", "-o", "o.exr", "--pixel", "1,1"),
            "combine": ("--crn", "a.exr", "--independent", "b.exr", "-o", "o.exr"),
            "compare": ("a.exr", "--reference", "b.exr", "--error-map", "e.png"),
            "convert": ("a.exr", "o.png"), "view": ("a.exr", "-o", "o.html"), "experiment": ("scene.xml", "-o", "o")}
METHODS = {"--estimator": ("iicv", "cv-baseline", "iduw", "dependent-tests"),
           "--integrator": ("controlled-path", "guided-path")}
SCENE = b"""<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm">
  <integer name="width" value="4"/><integer name="height" value="4"/></film></sensor>
  <shape type="sphere"><emitter type="area"><rgb name="radiance" value="1"/></emitter></shape></scene>"""


class Numbers(CliTest):
    def setUp(self):
        super().setUp()
        self.write("scene.xml", SCENE)
        for seed, name in ((1, "a.exr"), (2, "b.exr")):
            self.write(name, film(seed, groups=3, size=(5, 4), samples=6))

    def options(self, command):
        text = self.good(command, "--help-all").stdout
        found = re.findall(r"^ +(?:-\w, )?(--[\w-]+)(?:, --[\w-]+)* +(\S+)", text, re.MULTILINE)
        return [name for name, kind in found if KINDS.search(kind) and "NAME" not in kind]

    def test_are_numbers(self):
        n_options = 0
        for command, arguments in COMMANDS.items():
            for option in self.options(command):
                n_options += 1
                others = [a for i, a in enumerate(arguments) if option not in arguments[max(i - 1, 0):i + 1]]
                for value in NO_NUMBERS:
                    with self.subTest(command=command, option=option, value=value):
                        self.bad(2, option, command, *others, f"{option}={value}")
        self.assertGreater(n_options, 35)

    def test_parameters_are_numbers(self):
        """Those of methods and integrators, by --set, as `covary help METHOD` lists them."""
        n_parameters = 0
        for kind, methods in METHODS.items():
            for method in methods:
                listed = re.findall(r"^ +([\w-]+)=(\S+)", self.good("help", method).stdout, re.MULTILINE)
                for parameter in [name for name, value in listed if KINDS.search(value)]:
                    n_parameters += 1
                    for value in NO_NUMBERS:
                        with self.subTest(method=method, parameter=parameter, value=value):
                            self.bad(2, f"--set {parameter}", "render", *COMMANDS["render"], kind, method, "--set",
                                     f"{parameter}={value}")
        self.assertGreater(n_parameters, 12)


if __name__ == "__main__":
    unittest.main()
