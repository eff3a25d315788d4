"""The whole way in a real browser: from an empty page to a verdict and a point on the table."""

import re
import signal
import subprocess
import sys
import time

import pytest
from hecbench_hardware.cockpit.command import cockpit

pytest.importorskip("viser")

SMALL = ("--set", "camera.width=816", "--set", "camera.height=683")
PATIENCE_S = 240.0


class Shown:
    """The page as a person uses it."""

    def __init__(self, browser):
        self.browser = browser

    @property
    def text(self):
        return self.browser.execute_script("return document.body.innerText")

    def wait_for(self, pattern):
        end = time.monotonic() + PATIENCE_S
        while not (found := re.search(pattern, self.text)):
            assert time.monotonic() < end, f"'{pattern}' does not come: {self.text}"
            time.sleep(0.1)
        return found

    def press(self, label):
        from selenium.webdriver.common.by import By

        self.wait_for(re.escape(label))
        buttons = self.browser.find_elements(By.TAG_NAME, "button")
        button = next(button for button in buttons if button.text.strip() == label)
        self.browser.execute_script("arguments[0].click()", button)

    def open_tab(self, name):
        from selenium.webdriver import ActionChains
        from selenium.webdriver.common.by import By

        tabs = self.browser.find_elements(By.CSS_SELECTOR, "[role=tab]")
        tab = next(tab for tab in tabs if tab.text.strip() == name)
        ActionChains(self.browser).move_to_element(tab).click().perform()


@pytest.fixture
def server(drawable, tmp_path):
    """The verb on the simulated cell; ended by its own process."""
    command = [
        sys.executable,
        "-m",
        "hecbench",
        "cockpit",
        "--port",
        "0",
        "--out",
        str(tmp_path / "cell"),
        *SMALL,
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    yield process
    process.send_signal(signal.SIGTERM)
    assert process.wait(30) == 130


@pytest.mark.timeout(1200)
def test_from_an_empty_page_to_a_verdict(server, browser, tmp_path):
    browser.set_window_size(900, 700)
    browser.get(re.search(r"http://\S+", server.stdout.readline()).group())
    page = Shown(browser)
    page.press("connect")
    page.wait_for("the robot stands still")
    for number in range(6):
        page.press("drive there")
        page.wait_for("arrived")
        page.press("take a sample")
        page.wait_for(f"sample {number:06d} taken, the target seen")
        page.wait_for(rf"{number + 1} samples?, the target seen in {number + 1}\b")
    page.press("take a sample")
    page.wait_for("stands where sample 000005 was taken")
    page.open_tab("verdict")
    page.wait_for(r"(good|usable) \(6 samples\)")
    page.wait_for(r"expected error in the workspace: [\d.]+ mm \[")
    page.open_tab("point")
    page.press("look through the camera")
    page.press("point at this pixel")
    page.open_tab("record")
    page.wait_for("does not meet the plane")
    page.press("take the last one back")
    page.wait_for("5 samples, the target seen in 5")
    assert len(list((tmp_path / "cell/images").iterdir())) == 5
    assert not [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--arm"], "name the arm that may move with --robot"),
        (["--robot", "ur5e"], "give a CELL"),
        (["--robot", "lab", "--camera", "uvc"], "give a CELL"),
        (["absent"], "does not exist"),
        (["--robot", "lab", "--set", "robot.wings=2"], "has no option wings"),
    ],
)
def test_bad_usage_is_named(arguments, said):
    from click.testing import CliRunner

    from hecbench.errors import InputError

    result = CliRunner().invoke(cockpit, [*arguments, "--port", "0"])
    assert isinstance(result.exception, InputError)
    assert said in str(result.exception)


def test_finish_calibrates_what_was_recorded(recorded, monkeypatch):
    from hecbench.running import planning

    marker = [spec for spec in planning.solvers_for(("bundle", "shah"), recorded.recording())]
    monkeypatch.setattr(planning, "solvers_for", lambda names, recording: marker)
    from hecbench_hardware.cockpit.command import finish

    verdict = finish(5.0, recorded)
    assert verdict.recommended is not None
    assert (recorded.folder / "calibration/report.html").is_file()
