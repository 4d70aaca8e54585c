"""Sphinx configuration. Build with `python -m sphinx -W -n docs build/docs`; it needs no network and no display."""

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))
os.environ.update(SDL_VIDEODRIVER="dummy", SDL_AUDIODRIVER="dummy", PYGAME_HIDE_SUPPORT_PROMPT="1")

import sandbox

project = "sandbox"
author = "the sandbox authors"
copyright = "2026, the sandbox authors"
release = version = sandbox.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_click",
    "sphinx_design",
    "sphinx_copybutton",
    "answers",
    "api_docstrings",
    "generated",
    "hidden_directives",
    "lesson_notebooks",
    "mathml",
]

myst_enable_extensions = ["attrs_inline", "colon_fence", "deflist", "dollarmath", "fieldlist"]
myst_heading_anchors = 3
myst_links_external_new_tab = False
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300  # s a cell
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_preserve_defaults = True
autodoc_default_options = {"members": True}
default_role = "code"  # docstrings write `name`
nitpick_ignore_regex = [
    ("py:.*", r"(numpy|np|npt|pandas|polars|pydantic|gymnasium|pymunk|collections|pathlib|typing)\..*"),
    ("py:.*", r"sandbox\..*"),  # types within that have no page
    ("py:.*", r"[A-Z]\w*|\w+Array|optional"),  # names of type aliases
    ("py:class", r"Path|Any|(annotated_types|types)\..*"),
]
napoleon_google_docstring = True
napoleon_numpy_docstring = False

html_math_renderer = "mathml"
html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_title = f"sandbox {version}"
exclude_patterns = ["_build"]
copybutton_exclude = ".linenos, .gp, .go"  # prompts and output stay out of what is copied

linkcheck_timeout = 20  # s for an answer
linkcheck_retries = 3  # before a link counts as broken: sites fail now and then
linkcheck_workers = 4
linkcheck_rate_limit_timeout = 60  # s to wait at most where a site asks to slow down
linkcheck_anchors = False  # sites that build their pages by scripts have no anchors in what they send
# Regular expressions of addresses that cannot be checked, each with its reason, such as a site that refuses programs.
linkcheck_ignore: list[str] = []
