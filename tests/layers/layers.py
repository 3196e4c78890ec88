#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""House rules that a compiler does not check, over the files of one source tree.

Each check is a function from the tree's root to a list of problems "file:line: what is wrong". layers_test.py runs them
over this project and over trees with planted violations. On the command line: layers.py [--lengths] ROOT.
"""
import ast
import os
import re
import subprocess
import sys

# What each module may include, the arrows of docs/architecture.md. Entries are direct; everything behind them follows.
ARROWS = {
    "core": [],
    "device": ["core"],
    "settings": ["core"],
    "imageio": ["core"],
    "film": ["imageio"],
    "metrics": ["film"],
    "filters": ["film"],
    "estimators": ["filters", "settings"],
    "dependent_tests": ["estimators"],
    "risk": ["estimators"],
    "weighing": ["filters"],
    "denoising": ["risk", "weighing"],
    "sequences": ["denoising"],
    "gpu": ["device", "dependent_tests", "denoising"],
    "combine": ["gpu"],
    "lab": ["report", "sequences"],
    "papers": ["lab"],
    "report": ["metrics"],
    "scene": ["settings"],
    "textures": ["scene", "imageio"],
    "tensors": ["core"],
    "bsdfs": ["tensors", "textures"],
    "emitters": ["textures"],
    "media": ["scene"],
    "meshes": ["scene"],
    "formats": ["scene"],
    "pbrt_text": ["formats"],
    "pbrt": ["pbrt_text"],
    "gltf": ["formats"],
    "io": ["pbrt", "gltf", "bsdfs", "emitters", "media", "meshes"],
    "sampling": ["scene"],
    "passes": ["scene", "film"],
    "integrators": ["passes", "sampling"],
    "plans": ["combine", "integrators", "io"],
    "live": ["plans", "report"],
}
SOURCE_FOLDERS = ["src", "include", "apps", "python", "tests", "benchmarks"]
CPP = (".h", ".cpp", ".cu", ".cuh")
INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"')
CITATION = re.compile(r"\[([A-Z][A-Za-z]+\d{4}[a-z]?)\]")
LONG_FILE = 450
COLUMNS = 120  # of code and prose
LINES = 400  # of a file of code, tests apart
FUNCTION_LINES = 60
MODULE_LINES = 5000
WRAPPED = (".h", ".cpp", ".cu", ".cuh", ".py", ".md", ".js", ".cmake", "CMakeLists.txt", "Makefile")


def visible_modules(module):
    """The module itself and everything its arrows lead to."""
    seen, todo = {module}, [module]
    while todo:
        for target in ARROWS[todo.pop()]:
            if target not in seen:
                seen.add(target)
                todo.append(target)
    return seen


def files(root, folders, endings):
    for folder in folders:
        for directory, subdirectories, names in os.walk(os.path.join(root, folder)):
            subdirectories.sort()
            for name in sorted(names):
                if name.endswith(endings):
                    yield os.path.relpath(os.path.join(directory, name), root)


def read(root, path):
    with open(os.path.join(root, path), encoding="utf-8") as file:
        return file.read()


def lines(root, path):
    return list(enumerate(read(root, path).splitlines(), 1))


def is_test(path):
    return re.search(r"_(test|bench)\.(cpp|cu)$", path) is not None


def is_script(root, path):
    with open(os.path.join(root, path), "rb") as file:
        return file.read(2) == b"#!"


def includes_follow_arrows(root):
    """A module includes itself and the modules its arrows lead to. Tests see every module, and alone the helpers of
    tests/."""
    problems = []
    for path in files(root, ["src", "include", "apps", "python"], CPP):
        parts = path.split(os.sep)
        module = parts[1] if parts[0] == "src" else parts[0]
        if parts[0] == "src" and module not in ARROWS:
            problems.append(f"{path}:1: src/{module} is not a module; known are {', '.join(sorted(ARROWS))}")
            continue
        for number, text in lines(root, path):
            match = INCLUDE.match(text)
            if not match:
                continue
            target = match[1]
            here = f"{path}:{number}: "
            folder = target.split("/")[0]
            if ".." in target.split("/"):
                problems.append(here + f"'{target}' climbs out of its folder; name the module instead")
            elif folder == "apps" or ("/" not in target and parts[0] != "apps"):
                problems.append(here + f"'{target}' does not name a module")
            elif folder in ARROWS:
                if parts[0] == "src" and not is_test(path) and folder not in visible_modules(module):
                    seen = ", ".join(sorted(visible_modules(module)))
                    problems.append(here + f"{module} may not include '{target}'; it sees {seen}")
            elif os.path.exists(os.path.join(root, "tests", target)) and not is_test(path):
                problems.append(here + f"'{target}' is for tests only")
    return problems


def python_imports(root, path):
    """Names of the files beside this one that it imports: at its top, inside of functions, for types alone."""
    names = set()
    for node in ast.walk(ast.parse(read(root, path))):
        if isinstance(node, ast.ImportFrom) and node.level == 1:
            names |= {node.module} if node.module else {name.name for name in node.names}
    return names


def python_has_no_circle(root):
    """No file of the Python package imports itself through others."""
    imports = {os.path.basename(path)[:-3]: python_imports(root, path)
               for path in files(root, ["python/covary"], ".py")}
    problems = []
    for start in sorted(imports):
        ways = [[name] for name in sorted(imports[start] & imports.keys())]
        seen = set()
        for way in ways:  # grows
            if way[-1] == start:
                problems.append(f"python/covary/{start}.py:1: imports itself: {' -> '.join([start, *way])}")
                break
            new = (imports[way[-1]] & imports.keys()) - seen
            seen |= new
            ways += [[*way, name] for name in sorted(new)]
    return problems


def links_follow_arrows(root):
    """The DEPENDS of a module's CMakeLists.txt obey the same arrows."""
    problems = []
    for module in ARROWS:
        path = os.path.join("src", module, "CMakeLists.txt")
        if not os.path.exists(os.path.join(root, path)):
            continue
        text = "\n".join(text.split("#")[0] for _, text in lines(root, path))
        for names in re.findall(r"\bDEPENDS\b([^)]*?)(?=\b(?:TESTS|TESTS_TOGETHER|TEST_DEPENDS|SOURCES)\b|\))", text):
            for target in re.findall(r"covary_(\w+)", names):
                if target in ARROWS and target not in visible_modules(module):
                    problems.append(f"{path}:1: {module} may not depend on covary_{target}")
    return problems


DRAWN = re.compile(r"^ {8}(\w+)/(?: +──► ([\w, ]+))?$")


def architecture_draws_the_arrows(root):
    """The folder tree in docs/architecture.md has every module with its arrows, those of ARROWS, and no others."""
    page = os.path.join("docs", "architecture.md")
    drawn = {match[1]: (number, re.findall(r"\w+", match[2] or ""))
             for number, text in lines(root, page) if (match := DRAWN.match(text))}
    folders = sorted(entry.name for entry in os.scandir(os.path.join(root, "src")) if entry.is_dir())
    problems = [f"{page}:1: lacks src/{module}" for module in folders if module not in drawn]
    for module, (number, targets) in drawn.items():
        if module not in folders:
            problems.append(f"{page}:{number}: draws src/{module}, which there is not")
        elif sorted(targets) != sorted(ARROWS.get(module, [])):
            problems.append(f"{page}:{number}: {module} has arrows to {', '.join(ARROWS[module]) or 'nothing'}")
    return problems


def licence_lines(root):
    """Every source file names its licence in one of its first two lines."""
    problems = []
    scripts = [path for path in files(root, ["scripts", ".ci"], ("",)) if not path.endswith((".txt", ".md"))]
    for path in [*files(root, SOURCE_FOLDERS, (*CPP, ".py")), *scripts]:
        head = " ".join(text for _, text in lines(root, path)[:2])
        if "SPDX-License-Identifier: Apache-2.0" not in head:
            problems.append(f"{path}:1: lacks the line 'SPDX-License-Identifier: Apache-2.0'")
    return problems


FORBIDDEN = [
    (re.compile(r"^\s*#\s*if\s+0\b"), "disabled code; delete it"),
    (re.compile(r"\b(TODO|FIXME|XXX)\b(?!\(#\d+\))"), "a note for later without an issue number: write TODO(#12)"),
    (re.compile(r"\bGTEST_SKIP\b|\bDISABLED_\w+"), "a test that does not run"),
]


def no_leftovers(root):
    """No disabled code, no notes for later without an issue, no tests that do not run."""
    problems = []
    for path in files(root, SOURCE_FOLDERS, (*CPP, ".py")):
        if path.startswith(os.path.join("tests", "layers")):
            continue  # the patterns and their planted violations themselves
        for number, text in lines(root, path):
            problems += [f"{path}:{number}: {reason}" for pattern, reason in FORBIDDEN if pattern.search(text)]
    return problems


def citations_have_entries(root):
    """Every [Key2024] in the code and the documentation has an entry in docs/references.bib."""
    known = set(re.findall(r"^@\w+\{(\w+),", read(root, os.path.join("docs", "references.bib")), re.M))
    problems = []
    for path in [*files(root, SOURCE_FOLDERS, CPP), *files(root, ["docs"], (".md",))]:
        for number, text in lines(root, path):
            problems += [f"{path}:{number}: [{key}] is not in docs/references.bib"
                         for key in CITATION.findall(text) if key not in known]
    return problems


REGISTRIES = {
    "io": ["shapes.cpp", "object_factory.cpp"],
    "textures": ["registry.cpp"],
    "bsdfs": ["registry.cpp"],
    "emitters": ["registry.cpp"],
    "media": ["registry.cpp"],
    "integrators": ["registry.cpp"],
}


def documented_names_match_registries(root):
    """docs/scene-format.md has a heading for each plugin of each module's registry, and no others.

    A registry has `PLUGIN(T, name)`, or lines `{"name", make_something}`; in the page, plugins are the names in
    backquotes in `###` headings
    below the `##` heading that ends in "(`module`)".
    """
    documented, module = {}, None
    for _, text in lines(root, os.path.join("docs", "scene-format.md")):
        if text.startswith("## "):
            heading = re.search(r"\(`(\w+)`\)$", text)
            module = heading[1] if heading else None
        elif module and text.startswith("### "):
            documented.setdefault(module, set()).update(re.findall(r"`([\w-]+)`", text))
    problems = []
    for module, names in REGISTRIES.items():
        registered = set()
        for path in (os.path.join("src", module, name) for name in names):
            if not os.path.exists(os.path.join(root, path)):
                continue
            text = "\n".join(text.split("//")[0] for _, text in lines(root, path))
            found = re.findall(r'\{\s*"([\w-]+)"\s*,\s*(?:make_|k[A-Z])\w+\s*\}|PLUGIN\(T, (\w+)\)', text)
            found = [first or second for first, second in found]
            registered.update(found)
            if not found:
                problems.append(f"{path}:1: no plugin found here; is it still written as {{\"name\", make_name}}?")
        for name in sorted(registered - documented.get(module, set())):
            problems.append(f"docs/scene-format.md:1: lacks '{name}' of src/{module}")
        for name in sorted(documented.get(module, set()) - registered):
            problems.append(f"docs/scene-format.md:1: describes '{name}', which src/{module} does not have")
    return problems


PARAMETER = re.compile(r'\b(?:p|parameters)(?:\.(?:(?:get|require)_\w+|find_texture)\(|,)\s*"(\w+)"')


def documented_parameters(root):
    """Every parameter name that a plugin reads stands in backquotes in docs/scene-format.md; those of scenes of pbrt,
    which files pbrt_* read, in docs/pbrt.md."""
    problems = []
    for path in files(root, ["src"], (".cpp", ".h")):
        if is_test(path):
            continue
        page = "docs/pbrt.md" if os.path.basename(path).startswith("pbrt_") else "docs/scene-format.md"
        found = [(number, name) for number, text in lines(root, path) for name in PARAMETER.findall(text)]
        documented = read(root, page) if found else ""
        problems += [f"{page}:1: lacks the parameter '{name}' of {path}:{number}" for number, name in found
                     if f"`{name}`" not in documented]
    return problems


def documented_commands(root):
    """Every subcommand of the program is in the README, as `covary name …`."""
    readme = read(root, "README.md")
    return [f"README.md:1: lacks the command 'covary {name}' of {path}:{number}"
            for path in files(root, ["apps"], (".cpp",)) for number, text in lines(root, path)
            for name in re.findall(r'add_subcommand\("(\w+)"', text) if f"`covary {name} " not in readme]


def lines_fit(root):
    """No line of code or prose has more than COLUMNS characters, but for addresses, which cannot be broken; scenes,
    suites and other data may. Tracked files only, where the tree is a repository."""
    listed = subprocess.run(["git", "ls-files"], cwd=root, capture_output=True, text=True).stdout.splitlines()
    problems = []
    for path in listed or files(root, ["."], ""):
        if os.path.isfile(os.path.join(root, path)) and (path.endswith(WRAPPED) or is_script(root, path)):
            problems += [f"{path}:{number}: {len(text)} columns; at most {COLUMNS}"
                         for number, text in lines(root, path) if len(text) > COLUMNS and "://" not in text]
    return problems


def files_fit(root):
    """No file of code has more than LINES lines, but for tests: what is longer does more than one thing."""
    counts = {path: sum(1 for _ in lines(root, path))
              for path in files(root, ["src", "apps", "python"], (".cpp", ".h")) if not is_test(path)}
    return [f"{path}:{n}: {n} lines; at most {LINES}" for path, n in counts.items() if n > LINES]


# What may hold braces and semicolons that are no code: comments, strings, characters, lines of the preprocessor.
NO_CODE = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"'
                     r"|(?<![0-9a-fA-F])'(?:\\.|[^'\\\n])+'|^[ \t]*#(?:\\\n|[^\n])*", re.S | re.M)


def cpp_functions(text):
    """First line, last line and head of each function that is defined in a namespace or class."""
    text = NO_CODE.sub(lambda match: "\n" * match[0].count("\n") or " ", text)
    line_of = lambda position: text.count("\n", 0, position) + 1
    scopes, head_start = [], 0
    for match in re.finditer(r"[{};]|\b(?:public|private|protected):", text):
        head = text[head_start:match.start()]
        if match[0] == "{":
            if any(kind != "scope" for kind, _, _ in scopes):
                kind = "block"
            elif re.search(r"\b(?:namespace|class|struct|union|enum|extern)\b[^()]*$", head):
                kind = "scope"
            else:
                kind = "function" if "(" in head and not head.rstrip().endswith("=") else "block"
            scopes.append((kind, line_of(match.start() - len(head.lstrip())), " ".join(head.split())))
        elif match[0] == "}":
            kind, first, head = scopes.pop()
            if kind == "function":
                yield first, line_of(match.start()), head
        head_start = match.end()


def python_functions(text):
    """The same of Python, without docstrings: what is left of them."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            first = node.body[0]
            docstring = ast.get_docstring(node) is not None and first.end_lineno - first.lineno + 1
            yield node.lineno, node.end_lineno - docstring, node.name


def functions_fit(root):
    """No function has more than FUNCTION_LINES lines, but for tests."""
    problems = []
    for path in files(root, ["src", "apps", "python"], (".cpp", ".h", ".py")):
        functions = python_functions if path.endswith(".py") else cpp_functions
        problems += [f"{path}:{first}: {last - first + 1} lines of '{name[:60]}'; at most {FUNCTION_LINES}"
                     for first, last, name in functions(read(root, path)) if not is_test(path)
                     and last - first >= FUNCTION_LINES]
    return problems


def modules_fit(root):
    """No module has more than MODULE_LINES lines, but for tests: what is larger holds more than one thing."""
    counts = {}
    for path in files(root, ["src"], CPP):
        if not is_test(path):
            module = path.split(os.sep)[1]
            counts[module] = counts.get(module, 0) + len(lines(root, path))
    return [f"src/{module}:1: {n} lines; at most {MODULE_LINES}" for module, n in counts.items() if n > MODULE_LINES]


def together_hides_no_constant(root):
    """Where the files of a module are compiled together, a constant in the anonymous namespace of one file would take
    the place of one of the same name that another file has from a header, without a word from the compiler."""
    problems = []
    for path in files(root, ["src", "apps"], ("CMakeLists.txt",)):
        if not re.search(r"covary_module\(\w+ TOGETHER|covary_together\(", read(root, path)):
            continue
        folder = os.path.dirname(path)
        texts = {file: re.sub(r"//.*", "", read(root, file)) for file in files(root, [folder], (".cpp",))
                 if os.path.dirname(file) == folder and not is_test(file)}
        for file, text in texts.items():
            for anonymous in re.findall(r"^namespace \{$(.*?)^\}", text, re.M | re.S):
                for name in re.findall(r"^constexpr\b[^(]*?\b(k[A-Z]\w*)(?=\s*[={\[])", anonymous, re.M):
                    problems += [f"{other}:1: {name} would be that of {file}, with which it is compiled"
                                 for other, uses in texts.items()
                                 if other != file and re.search(rf"(?<![\w.>:]){name}\b", uses)
                                 and not re.search(rf"\bconstexpr\b[^;]*\b{name}\b\s*[={{\[]", uses)]
    return problems


def suites_are_run(root):
    """A suite of Python tests runs if CMakeLists.txt beside it names the suite, or runs the file whole or by words."""
    problems = []
    for path in files(root, ["tests"], ("_test.py",)):
        folder, name = os.path.split(path)
        build = os.path.join(folder, "CMakeLists.txt")
        text = read(root, build) if os.path.exists(os.path.join(root, build)) else ""
        if re.search(rf"\b{name}(?=\s*\)|\s+[a-z])", text):
            continue
        for suite in ast.parse(read(root, path)).body:
            tests = isinstance(suite, ast.ClassDef) and any(getattr(m, "name", "").startswith("test")
                                                            for m in suite.body)
            if tests and not re.search(rf"\b{suite.name}\b", text):
                problems.append(f"{path}:{suite.lineno}: {build} does not run {suite.name}")
    return problems


CHECKS = [lines_fit, files_fit, functions_fit, modules_fit, includes_follow_arrows, links_follow_arrows,
          python_has_no_circle, architecture_draws_the_arrows, licence_lines, no_leftovers, citations_have_entries,
          documented_names_match_registries, documented_parameters, documented_commands, together_hides_no_constant,
          suites_are_run]


def length_report(root):
    """Files over LONG_FILE lines, longest first: each might be two files."""
    counted = [(len(lines(root, path)), path) for path in files(root, SOURCE_FOLDERS, (*CPP, ".py"))]
    return [f"{path}: {count} lines; would it be two files?"
            for count, path in sorted(counted, reverse=True) if count > LONG_FILE]


def main():
    root = sys.argv[-1]
    problems = [problem for check in CHECKS for problem in check(root)]
    print("\n".join(problems + (length_report(root) if "--lengths" in sys.argv else [])))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
