"""The recipe of CONTRIBUTING.md for a section of the report is carried out in a copy of the packages."""

from tests.project.recipes import copied, insert, recipe, run_script

SECTION = """
from pathlib import Path
from scenarios.report import write
from tests.doubles.run_folder import write_estimate, write_evaluation
run = Path("run")
run.mkdir()
write_evaluation(run)
write_estimate(run / "estimate")
write(run)
page = (run / "report.html").read_text()
assert "Clocks on the motion capture" in page and ">3.9000<" in page and ">12.0<" in page
"""


def test_a_section_of_the_report_is_a_module_a_template_and_its_name(tmp_path):
    sections = copied(tmp_path, "scenarios") / "scenarios/report/sections"
    (sections / "clocks.py").write_text(recipe("section"), encoding="utf-8")
    (sections / "clocks.html").write_text(recipe("section-template"), encoding="utf-8")
    face, line = sections / "__init__.py", "from scenarios.report.sections.clocks import Clocks\n"
    insert(face, "from scenarios.report.sections.errors import", line)
    insert(face, "    Stages,\n", "    Clocks,\n")
    run_script(tmp_path, SECTION)
