"""Results as JUnit XML, which continuous integration shows."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from xml.etree import ElementTree

from sandbox.text import xml_text


class Ending(StrEnum):
    """How a test case ends; the values are the names of its element."""

    PASSED = ""
    FAILURE = "failure"
    ERROR = "error"
    SKIPPED = "skipped"


@dataclass(frozen=True)
class TestCase:
    """One test case, as it is shown. message: one line; details: the whole text."""

    __test__ = False  # for pytest, which collects classes of this name

    classname: str
    name: str
    ending: Ending = Ending.PASSED
    message: str = ""
    details: str = ""


def junit_xml(suite: str, cases: Iterable[TestCase]) -> str:
    """Return a suite of test cases as XML."""
    root = ElementTree.Element("testsuites")
    element = ElementTree.SubElement(root, "testsuite", name=suite)
    count = Counter[Ending]()
    for case in cases:
        child = ElementTree.SubElement(element, "testcase", classname=case.classname, name=case.name)
        count[case.ending] += 1
        if case.ending:
            ElementTree.SubElement(child, case.ending.value, message=case.message).text = case.details or case.message
    for key, ending in (("failures", Ending.FAILURE), ("errors", Ending.ERROR), ("skipped", Ending.SKIPPED)):
        element.set(key, str(count[ending]))
    element.set("tests", str(count.total()))
    ElementTree.indent(root)
    xml: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return xml_text(xml.decode()) + "\n"
