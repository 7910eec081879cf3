"""Drives the studio's page in headless Chromium, as a person would.

    python tests/studio_e2e/drive.py target/debug/overcoat
    python tests/studio_e2e/drive.py target/release/overcoat --screenshot docs/studio.png

Needs chromium and chromium-driver (Debian's packages) and selenium from PyPI. The first form edits, moves, breaks and
saves a script and fails where the page does not follow; the second makes the picture of the README.
"""

import argparse
import json
import pathlib
import shutil
import subprocess
import tempfile
import time

from selenium import webdriver
from selenium.webdriver import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PATIENCE = 60


def browser(theme):
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or shutil.which("chromium-browser")
    for argument in ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]:
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
    metrics = {"width": 1280, "height": 800, "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    feature = {"name": "prefers-color-scheme", "value": theme}
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})
    return driver


class Page:
    def __init__(self, driver, address):
        self.driver = driver
        driver.get(address)
        self.source = driver.find_element(By.ID, "source")

    def run(self, script):
        return self.driver.execute_script("return " + script)

    def until(self, what, holds, patience=PATIENCE):
        """Waits for something to hold; says what did not."""
        end = time.monotonic() + patience
        while time.monotonic() < end:
            value = holds()
            if value:
                return value
            time.sleep(0.05)
        self.driver.save_screenshot(str(pathlib.Path(tempfile.gettempdir()) / "studio_e2e_failed.png"))
        raise AssertionError(f"{what}: not within {patience} s")

    def verdict(self, name):
        self.until(f"the verdict {name}", lambda: self.run("document.getElementById('verdict').dataset.verdict") == name)

    def frames(self):
        return int(self.run("document.getElementById('canvas-a').dataset.frames || 0"))

    def look(self):
        """The mean colour of the middle of the picture, once it is refined."""
        self.until("a refined picture", lambda: int((self.run("document.getElementById('progress').textContent") or "0/").split("/")[0]) >= 4)
        return self.run(
            "(() => { const c = document.getElementById('canvas-a'); const s = Math.floor(c.height / 4);"
            "const d = c.getContext('2d').getImageData((c.width - s) / 2, (c.height - s) / 2, s, s).data;"
            "const sum = [0, 0, 0]; d.forEach((x, i) => { if (i % 4 < 3) sum[i % 4] += x; });"
            "return sum.map((x) => x / (s * s)); })()"
        )

    def changes(self, what, act):
        """The picture is another one after `act`."""
        before, frames = self.look(), self.frames()
        act()
        self.until(f"a picture after {what}", lambda: self.frames() > frames + 1)
        differs = lambda: max(abs(a - b) for a, b in zip(before, self.look())) > 2
        self.until(f"another picture after {what}", differs)

    def keys(self, *keys):
        ActionChains(self.driver).send_keys(*keys).perform()

    def command(self, key):
        ActionChains(self.driver).key_down(Keys.CONTROL).send_keys(key).key_up(Keys.CONTROL).perform()

    def write(self, text):
        """Replaces the script by hand."""
        self.source.click()
        self.command("a")
        self.keys(text, Keys.ESCAPE)


def drive(page, folder):
    page.verdict("conserves")
    page.until("a picture", lambda: page.frames() > 0)
    assert page.run("document.title") == "velvet.osl – overcoat studio"

    # A slider made from the script's declaration.
    slider = page.driver.find_element(By.ID, "parameter-roughness")
    page.changes("a slider", lambda: (slider.send_keys(Keys.END), None))
    assert page.run("document.querySelector('[data-name=roughness] input[type=number]').value") == "1"

    # The picture follows the script, and so does the verdict.
    page.changes("an edit", lambda: page.write("Ci = diffuse(N) + diffuse(N);"))
    page.verdict("gains")
    curve = page.run("document.querySelector('#albedo title').textContent")
    page.until("the curve above 1", lambda: "largest 2.00" in page.run("document.querySelector('#albedo title').textContent"))
    marked = "[...document.querySelectorAll('.mark-gain, .mark-part')].map((m) => m.textContent).join('')"
    page.until("the terms that add up", lambda: "diffuse" in page.run(marked))
    assert "2.00" in page.run("document.getElementById('verdict').textContent"), curve

    # A word that is none is underlined, and a better one is named.
    page.write("Ci = difuse(N);")
    page.until("an underlined word", lambda: page.run("document.querySelector('.mark-error')?.textContent") == "difuse")
    assert "did you mean diffuse" in page.run("document.getElementById('problems').textContent")
    page.verdict("error")
    assert not page.run("document.getElementById('stale').hidden")

    # Completion writes it, undo takes it back.
    page.write("Ci = 0.5 * ")
    page.keys("diff")
    page.until("completions", lambda: page.run("document.querySelector('#completions [aria-selected=true]')?.textContent ?? ''").startswith("diffuse"))
    page.keys(Keys.ENTER, "N", Keys.END, ";")
    assert page.source.get_attribute("value") == "Ci = 0.5 * diffuse(N);", page.source.get_attribute("value")
    page.verdict("conserves")
    page.command("z")
    assert page.source.get_attribute("value") != "Ci = 0.5 * diffuse(N);"
    page.write("Ci = 0.25 * diffuse(N);")

    # Saved as it is shown; what is saved elsewhere is shown.
    page.command("s")
    script = folder / "velvet.osl"
    page.until("the file", lambda: script.read_text() == "Ci = 0.25 * diffuse(N);")
    page.until("a clean tab", lambda: not page.run("document.title").startswith("•"))
    script.write_text("Ci = 0.75 * diffuse(N);")
    page.until("the edit made elsewhere", lambda: page.source.get_attribute("value") == script.read_text())

    # Turned by mouse, compared, pinned; other scenes.
    viewer = page.driver.find_element(By.ID, "viewer")
    page.driver.find_element(By.CSS_SELECTOR, "[data-scene=furnace]").click()
    page.look()
    page.changes("another scene", lambda: page.driver.find_element(By.CSS_SELECTOR, "[data-scene=sphere]").click())
    viewer.click()
    page.until("the pinned point", lambda: page.run("document.getElementById('energy-at').textContent").startswith("at the pin"))
    viewer.send_keys(Keys.ESCAPE)
    page.until("no pinned point", lambda: page.run("document.getElementById('pin').hidden"))
    viewer.send_keys(Keys.ENTER)
    page.until("the middle pinned", lambda: page.run("document.getElementById('energy-at').textContent").startswith("at the pin"))
    page.driver.find_element(By.ID, "compare").click()
    page.until("a second picture", lambda: int(page.run("document.getElementById('canvas-b').dataset.frames || 0")) > 0)
    page.driver.find_element(By.ID, "compare").click()
    turned = lambda: ActionChains(page.driver).drag_and_drop_by_offset(viewer, 80, 20).perform()
    frames = page.frames()
    turned()
    page.until("a picture from elsewhere", lambda: page.frames() > frames)

    # All of it fits, and nothing went wrong that the page did not tell.
    assert page.run("document.documentElement.scrollWidth <= 1280 && document.documentElement.scrollHeight <= 800")
    log = [line for line in page.driver.get_log("browser") if line["level"] == "SEVERE"]
    assert not log, json.dumps(log, indent=1)


def screenshot(page, path):
    page.until("a picture", lambda: page.run("document.getElementById('progress').textContent").startswith("256/"), 600)
    page.until("the curves", lambda: page.run("document.querySelectorAll('#albedo .curve').length") > 1)
    page.until("the cost", lambda: page.run("document.querySelectorAll('#cost td').length") > 4)
    box = page.run("(() => { const b = document.getElementById('viewer').getBoundingClientRect(); return [b.x + b.width * 0.62, b.y + b.height * 0.36]; })()")
    ActionChains(page.driver).move_by_offset(*(int(x) for x in box)).click().perform()
    page.until("the pinned point", lambda: page.run("document.getElementById('energy-at').textContent").startswith("at the pin"))
    # The signature of the call that the caret is in.
    page.run("(() => { const s = document.getElementById('source'); const at = s.value.indexOf('sheen(Ci') + 14; s.focus(); s.setSelectionRange(at, at); })()")
    time.sleep(1)
    page.driver.save_screenshot(str(path))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--screenshot", type=pathlib.Path)
    parser.add_argument("--script", default="velvet.osl", help="the example to show")
    parser.add_argument("--theme", choices=["dark", "light"], default="dark")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        shutil.copy(ROOT / "examples" / arguments.script, folder)
        command = [arguments.program.resolve(), "studio", "--no-open", "--json", folder / arguments.script]
        studio = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        driver = browser(arguments.theme)
        try:
            told = ""
            while not told.endswith("}\n"):
                told += studio.stdout.readline()
            page = Page(driver, json.loads(told)["address"])
            if arguments.screenshot:
                screenshot(page, arguments.screenshot)
            else:
                drive(page, folder)
        finally:
            driver.quit()
            studio.terminate()
            studio.wait()


if __name__ == "__main__":
    main()
