# SPDX-License-Identifier: Apache-2.0
"""covary help: the man page and the completions hold what the help of the commands says, and the tools that read them
accept them."""
import re
import subprocess
import unittest
from pathlib import Path

from cli_test import CliTest

SOURCE = Path(__file__).resolve().parents[2]


class HelpTest(CliTest):
    def setUp(self):
        super().setUp()
        names = self.good("help").stdout.split("\nCommands:")[1]
        self.commands = re.findall(r"^  ([\w-]+) ", names, re.M)
        self.options = {name: self.options_in(self.good(name, "--help-all").stdout) for name in self.commands}
        self.assertIn("render", self.commands)
        self.assertIn("--estimator", self.options["render"])

    def options_in(self, text):
        return re.findall(r"(?:^ +|^  -\w, |, )(--[\w-]+)(?=[, ]|$)", text, re.M)

    def script(self, shell):
        self.write("script", self.good("help", "--completion", shell).stdout.encode())
        return str(self.path / "script")

    def shell(self, *arguments):
        result = subprocess.run(arguments, cwd=self.path, capture_output=True, text=True, timeout=60)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        return result.stdout


class Help(HelpTest):
    def test_of_a_command(self):
        self.assertEqual(self.good("help", "render").stdout, self.good("render", "--help").stdout)
        self.assertEqual(self.good("help").stdout, self.good("--help").stdout)
        self.assertEqual(self.good("help", "render", "--all").stdout, self.good("render", "--help-all").stdout)
        self.bad(2, "unknown command 'rendr'; did you mean 'render'?", "help", "rendr")
        self.bad(2, "--completion", "help", "--completion", "tcsh")
        self.bad(2, "COMMAND excludes --man", "help", "render", "--man")


class OneScreen(HelpTest):
    """What a person needs who wants a picture; the rest by group in --help-all."""

    WANTED = ("--output --spp --until --time --integrator --estimator --denoise --seed --resolution --crop --max-depth "
              "--passes --resume --threads --json --quiet --define --help-all").split()

    def test_of_render(self):
        lines = self.good("render", "--help").stdout.splitlines()
        self.assertLessEqual(len(lines), 40)
        self.assertLessEqual(max(map(len, lines)), 100)
        shown = self.options_in("\n".join(lines))
        self.assertLessEqual(set(self.WANTED), set(shown))
        self.assertNotIn("--set", shown)
        hidden = len({line for line in self.good("render", "--help-all").stdout.splitlines()
                      if re.match(r" +-", line)}) - len({line for line in lines if re.match(r" +-", line)})
        self.assertIn(f"{hidden} more options", lines[-1])

    def test_all_options(self):
        text = self.good("render", "--help-all").stdout
        self.assertLessEqual(max(map(len, text.splitlines())), 100)
        self.assertLessEqual({"--set", "--split", "--paper", "--oidn", *self.WANTED}, set(self.options_in(text)))
        lines = text.splitlines()
        for line, below in zip(lines, [*lines[1:], ""], strict=True):
            if re.match(r" {2,6}-", line):
                self.assertTrue(re.search(r"\S  +\S", line) or below.startswith(27 * " "), line)
        headings = re.findall(r"^(\S.*):$", text, re.M)
        self.assertEqual(headings[:2], ["Arguments", "Options"])
        self.assertLessEqual({"Sampling", "Methods"}, set(headings))
        self.assertEqual(len(headings), len(set(headings)))

    def test_parameters_of_methods(self):
        """Comparisons and papers vary many numbers; all share one option, and the help of a method lists its own."""
        self.assertLessEqual(len(self.options["render"]), 60)
        of_iicv = self.good("help", "iicv").stdout
        for line in ("covary render SCENE -o OUT.exr --estimator iicv", "Parameters (--set NAME=VALUE):",
                     "  penalty=pilot|sample|asymmetric", "  --paper "):
            self.assertIn("\n" + line, "\n" + of_iicv)
        of_guided = self.good("help", "guided-path").stdout
        self.assertIn("\n  nee=on|off", of_guided)
        self.assertNotIn("cv-grid", of_guided)
        self.assertLessEqual(max(map(len, (of_iicv + of_guided).splitlines())), 100)
        self.bad(2, "no method has a parameter 'windwo'; expected ", "render", "x.xml", "-o", "x.exr", "--set",
                 "windwo=3")
        self.bad(2, "; did you mean 'window'?", "render", "x.xml", "-o", "x.exr", "--set", "windwo=3")
        self.bad(2, "--set: 'window': expected NAME=VALUE, e.g. k=50", "render", "x.xml", "-o", "x.exr", "--set",
                 "window")
        for former, now in (("--k", "--set k=VALUE"), ("--live-port", "--live=PORT"), ("--pt", "--independent"),
                            ("--relative-error", "--until relative=X")):
            self.bad(2, f"unknown option '{former}': write {now}; see", "render", "x.xml", "-o", "x.exr", former, "9")

    def test_commands(self):
        text = self.good("--help").stdout
        main, laboratory = text.split("\nCommands:\n")[1].split("\nLaboratory:\n")
        names = [re.findall(r"^  ([\w-]+)", part, re.M) for part in (main, laboratory)]
        self.assertEqual(names[0][:5], ["render", "combine", "denoise", "compare", "view"])
        self.assertLessEqual({"experiment", "probe"}, set(names[1]))

    def test_everything(self):
        text = self.good("--help-all").stdout
        for command in self.commands:
            self.assertIn(self.good(command, "--help-all").stdout, text)


class Pages(HelpTest):
    """The pages name options that there are."""

    #: Of Dask, Slurm, `covary experiment --cluster`, and scripts that the pages name.
    OTHERS = {"--cluster", "--scheduler-file", "--local-directory", "--requeue", "--variants", "--each-trained"}

    def test_options(self):
        known = {option for options in self.options.values() for option in options} | self.OTHERS
        pages = [SOURCE / "README.md", *sorted((SOURCE / "docs").rglob("*.md"))]
        self.assertGreater(len(pages), 20)
        unknown = {f"{page.relative_to(SOURCE)}: {option}" for page in pages
                   for option in re.findall(r"`(--[a-z][a-z-]*)", page.read_text()) if option not in known}
        self.assertEqual(unknown, set())


class Manual(HelpTest):
    def test_has_every_option(self):
        page = self.good("help", "--man").stdout
        for command in self.commands:
            section = page.split(f".SS covary {command} ")[1].split("\n.S")[0].replace("\\-", "-")
            for option in self.options[command]:
                self.assertIn(f"\\fB{option}\\fR", section)

    def test_names_every_value(self):
        """What a value is called decides whether a suite may give it: nothing is left a mere TEXT."""
        page = self.good("help", "--man").stdout
        self.assertNotRegex(page, r"\\fITEXT")
        for name, value in (("oidn", "off|LIBRARY"), ("save\\-training", "FILE"), ("save\\-stages", "FOLDER"),
                            ("display\\-server", "HOST:PORT"), ("crop", "X,Y,WIDTH,HEIGHT")):
            self.assertIn(f"\\fB\\-\\-{name}\\fR \\fI{value}\\fR", page)

    def test_is_accepted_and_shown(self):
        self.write("covary.1", self.good("help", "--man").stdout.encode())
        self.shell("mandoc", "-T", "lint", "-W", "error", "covary.1")
        text = self.shell("mandoc", "-T", "ascii", "covary.1").replace("_\b", "")
        text = re.sub(".\b", "", text)
        self.assertIn("covary render [options] SCENE", text)
        self.assertIn("'-': standard output", text)


class Bash(HelpTest):
    def complete(self, *words):
        """What bash offers for the last word, as it splits the line."""
        quoted = " ".join("'" + word + "'" for word in words)
        script = self.script("bash")
        return self.shell("bash", "-c", f"source {script}; COMP_WORDS=(covary {quoted}); COMP_CWORD={len(words)}; "
                          "_covary; "
                          'echo "${COMPREPLY[@]}"').split()

    def test_commands(self):
        self.assertEqual(sorted(self.complete("")), sorted([*self.commands, "--help", "--help-all", "--version"]))
        self.assertEqual(self.complete("ren"), ["render"])

    def test_options(self):
        for command in self.commands:
            self.assertLessEqual(set(self.options[command]), set(self.complete(command, "--")))
        self.assertEqual(self.complete("render", "a.xml", "--est"), ["--estimator"])

    def test_values(self):
        estimators = ["iicv", "cv-baseline", "iduw", "polynomials", "none"]
        self.assertLessEqual(set(estimators), set(self.complete("render", "--estimator", "")))
        self.assertEqual(self.complete("render", "--estimator", "ii"), ["iicv"])
        self.assertEqual(self.complete("render", "--estimator", "=", "ii"), ["iicv"])
        self.assertEqual(self.complete("render", "--integrator", "contr"), ["controlled-path"])
        self.assertEqual(self.complete("render", "--spp", ""), [])
        self.assertEqual(self.complete("render", "-o", ""), [], "files are readline's matter")


class OtherShells(HelpTest):
    def test_zsh(self):
        self.shell("zsh", "-f", "-n", self.script("zsh"))
        text = Path(self.script("zsh")).read_text()
        for command in self.commands:
            section = text.split(f"    {command})\n")[1].split(";;")[0]
            for option in self.options[command]:
                self.assertRegex(section, rf"'\*{option}[=\[]")

    def test_fish(self):
        script = self.script("fish")
        def complete(line):
            lines = self.shell("fish", "--no-config", "-c", f"source {script}; complete -C '{line}'").splitlines()
            return [entry.split("\t")[0] for entry in lines]
        self.assertLessEqual(set(self.commands), set(complete("covary ")))
        for command in self.commands:
            self.assertLessEqual(set(self.options[command]), set(complete(f"covary {command} --")))
        self.assertEqual(complete("covary render --estimator ii"), ["iicv"])


if __name__ == "__main__":
    unittest.main()
