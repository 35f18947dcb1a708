#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Opens report.html of a small run in a browser and works it as people do: mouse, keys, buttons.

usage: report_page_test.py CGS CAPTURE FOLDER

What the page says is held against the photograph, the cameras and `cgs measure`. Pictures of the
page stay in FOLDER/screens. Exit status 77: the browser cannot be started.
"""
import base64
import io
import json
import pathlib
import re
import shutil
import subprocess
import sys
import time
import unittest

import numpy as np
from PIL import Image
from selenium import webdriver
from selenium.common.exceptions import WebDriverException
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.actions import interaction
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.actions.pointer_input import PointerInput
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

SKIPPED = 77
CGS, CAPTURE, FOLDER = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
OUT = FOLDER / 'run'
SCREENS = FOLDER / 'screens'


def setUpModule():
    shutil.rmtree(FOLDER, ignore_errors=True)
    SCREENS.mkdir(parents=True)
    capture = FOLDER / 'capture'
    shutil.copytree(CAPTURE, capture)
    crop_and_stretch(capture, 'view_02')
    # Metres that are not the units of the files, so that no figure is right by chance.
    subprocess.run([CGS, 'run', capture, '--views', 'view_01,view_02,view_03', '--assume-unit', 'ft',
                    '--set', 'steps=0', '--voxel-size', '3cm', '-q', '-o', OUT], check=True)


def crop_and_stretch(capture, name):
    """Makes a photograph whose principal point is off its middle and whose pixels are not square."""
    left, top, wider = 24, 9, 1.25
    document = json.loads((capture / 'transforms.json').read_text())
    frame = next(f for f in document['frames'] if name in f['file_path'])
    picture = Image.open(capture / frame['file_path']).crop((left, top, frame['w'], frame['h']))
    picture = picture.resize((int(picture.width * wider), picture.height), Image.BILINEAR)
    picture.save(capture / frame['file_path'])
    frame.update(w=picture.width, h=picture.height, fl_x=frame['fl_x'] * wider,
                 cx=(frame['cx'] - left) * wider, cy=frame['cy'] - top)
    (capture / 'transforms.json').write_text(json.dumps(document))


def browser(*more, phone=False):
    options = Options()
    for argument in ('--headless=new', '--no-sandbox', '--use-angle=swiftshader',
                     '--enable-unsafe-swiftshader', '--window-size=1300,1250', *more):
        options.add_argument(argument)
    if phone:
        size = {'width': 390, 'height': 844, 'pixelRatio': 2.0}
        options.add_experimental_option('mobileEmulation', {'deviceMetrics': size})
    options.set_capability('goog:loggingPrefs', {'browser': 'ALL', 'performance': 'ALL'})
    return webdriver.Chrome(service=Service('/usr/bin/chromedriver'), options=options)


class Page:
    """The report in one browser window."""

    def __init__(self, *more, **options):
        self.driver = browser(*more, **options)
        self.driver.get((OUT / 'report.html').resolve().as_uri())
        self.wait()

    def wait(self):
        for _ in range(600):
            if self.state():
                break
            time.sleep(0.1)

    def state(self):
        return self.viewer().get_attribute('data-state')

    def viewer(self):
        return self.driver.find_element(By.ID, 'viewer')

    def canvas(self):
        return self.driver.find_element(By.ID, 'viewer-canvas')

    def press(self, text):
        self.viewer().find_element(By.XPATH, f'.//button[text()="{text}"]').click()

    def settle(self):
        self.driver.execute_async_script(
            'const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done));')

    def picture(self):
        """What the stage shows."""
        self.settle()
        return pixels(self.canvas())

    def click(self, right, down):
        """Clicks on the canvas, so far from its middle [pixels]."""
        ActionChains(self.driver).move_to_element_with_offset(self.canvas(), right, down).click().perform()
        self.settle()

    def touch(self, right):
        """Puts a finger on the middle of the canvas and moves it [pixels]; 0 = a tap."""
        actions = ActionBuilder(self.driver, mouse=PointerInput(interaction.POINTER_TOUCH, 'finger'))
        actions.pointer_action.move_to(self.canvas()).pointer_down()
        if right:
            actions.pointer_action.move_to(self.canvas(), right, 0)
        actions.pointer_action.pointer_up()
        actions.perform()
        self.settle()

    def measured(self):
        return self.driver.find_element(By.ID, 'viewer-measured').text

    def legend(self):
        return self.driver.find_element(By.ID, 'viewer-legend').text

    def severe(self):
        return [entry for entry in self.driver.get_log('browser') if entry['level'] == 'SEVERE']

    def requests(self):
        """Addresses of everything that the page asked for."""
        out = []
        for entry in self.driver.get_log('performance'):
            message = json.loads(entry['message'])['message']
            if message['method'] == 'Network.requestWillBeSent':
                out.append(message['params']['request']['url'])
        return out


def pixels(element):
    """What an element of the page looks like, as RGB in [0, 1]."""
    png = base64.b64decode(element.screenshot_as_base64)
    return np.asarray(Image.open(io.BytesIO(png)).convert('RGB'), dtype=float) / 255


def changed(before, after):
    """Share of the pixels that look different."""
    return float(np.mean(np.abs(before - after).max(axis=-1) > 0.05))


def share_of_magenta(picture):
    red, green, blue = picture[..., 0], picture[..., 1], picture[..., 2]
    return float(np.mean((red > 0.4) & (blue > 0.35) & (green < 0.25)))


def measure(command):
    """Runs the command that the page states, in the folder of the run."""
    words = command.split()
    assert words[:2] == ['cgs', 'measure'], command
    done = subprocess.run([CGS, *words[1:], '--json'], cwd=OUT, check=True, capture_output=True)
    return json.loads(done.stdout)['figures']['distance']


def camera(name):
    cameras = json.loads((OUT / 'model/cameras.json').read_text())
    return next(c for c in cameras if c['img_name'] == name)


class ReportPage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.page = Page()
        print('loaded in', cls.page.viewer().get_attribute('data-milliseconds'), 'ms,',
              (OUT / 'report.html').stat().st_size, 'bytes')

    @classmethod
    def tearDownClass(cls):
        cls.page.driver.quit()

    def setUp(self):
        self.page.press('Photographs')
        self.page.press('All')
        self.page.canvas().send_keys(Keys.ESCAPE)

    def test_loads_without_an_error_and_without_the_network(self):
        self.assertEqual(self.page.state(), 'ready')
        self.assertEqual(self.page.severe(), [])
        requests = self.page.requests()
        self.assertIn((OUT / 'report.html').resolve().as_uri(), requests)
        for address in requests:
            self.assertRegex(address, r'^(file:///.*report\.html$|data:)')

    def test_shows_every_column_of_every_table(self):
        hidden = self.page.driver.execute_script('''
            return [...document.querySelectorAll('table, .scrolling')].filter(
              (table) => table.scrollWidth > table.clientWidth).map((table) => table.innerText);''')
        self.assertEqual(hidden, [])

    def test_every_look_is_another_picture(self):
        pictures = {}
        for look in ('Photographs', 'Colour', 'Provenance', 'Sigma', 'Gaussians'):
            self.page.press(look)
            pictures[look] = self.page.picture()
            self.page.driver.save_screenshot(str(SCREENS / f'{look.lower()}.png'))
            for other in pictures:
                if other != look:
                    self.assertGreater(changed(pictures[other], pictures[look]), 0.1, (other, look))
        self.assertGreater(share_of_magenta(pictures['Provenance']), 0.01)
        self.assertEqual(share_of_magenta(pictures['Photographs']), 0)

    def test_holes_of_the_gaussians_are_filled_at_a_switch(self):
        holes = self.page.driver.find_element(By.ID, 'viewer-fill')
        self.assertFalse(holes.is_displayed())
        self.page.press('view_02')
        self.page.press('Gaussians')
        canvas = self.page.canvas()
        canvas.send_keys(Keys.ESCAPE)  # the focus is drawn, too
        filled = self.page.picture()
        self.assertRegex(self.page.legend(), r'filled with \d+ synthetic')
        self.page.driver.save_screenshot(str(SCREENS / 'filled.png'))
        canvas.send_keys('f')
        self.assertGreater(changed(filled, self.page.picture()), 0.01)
        self.assertNotIn('synthetic', self.page.legend())
        canvas.send_keys('F')
        self.assertEqual(changed(filled, self.page.picture()), 0)
        self.page.press('Holes filled')
        self.assertEqual(holes.get_attribute('aria-pressed'), 'false')
        self.assertNotIn('synthetic', self.page.legend())
        self.page.press('Holes filled')

    def test_shows_from_its_place_what_the_photograph_shows(self):
        shot = camera('view_02')
        self.page.press('view_02')
        seen = self.page.picture()
        height, width = seen.shape[:2]
        scale = min(width / shot['width'], height / shot['height'])
        w, h = int(shot['width'] * scale), int(shot['height'] * scale)
        left, top = (width - w) // 2, (height - h) // 2
        seen = seen[top:top + h, left:left + w]
        photograph = Image.open(FOLDER / 'capture/images/view_02.png').convert('RGB')
        photograph = np.asarray(photograph.resize((w, h), Image.BILINEAR), dtype=float) / 255
        middle = (slice(h // 6, -h // 6), slice(w // 6, -w // 6))
        error = np.abs(seen - photograph)[middle].mean()
        mirrored = np.abs(seen[:, ::-1] - photograph)[middle].mean()
        self.assertLess(error, 0.03)
        self.assertGreater(mirrored, 2 * error)

    def test_two_clicks_measure_what_cgs_measures(self):
        shot = camera('view_02')
        self.page.press('view_02')
        clicks = [(-120, 40), (90, -60)]
        for at in clicks:
            self.page.click(*at)
        self.page.driver.save_screenshot(str(SCREENS / 'measured.png'))
        text = self.page.measured()
        value, sigma, unit = re.search(r'Distance ([\d.]+) ± ([\d.]+) (\S+)', text).groups()
        figure = measure(re.search(r'cgs measure .*', text).group())
        self.assertEqual(unit, figure['unit'])
        self.assertAlmostEqual(float(value), figure['value'], delta=0.51 * 10 ** -decimals(value))
        self.assertAlmostEqual(float(sigma), figure['sigma'], delta=0.51 * 10 ** -decimals(sigma))
        self.assertGreater(figure['sigma'], 0)
        for name, end, (right, down) in zip('AB', ('from', 'to'), clicks):
            self.assertLess(figure[end]['moved'], 1e-5)
            self.assertIn(f"{name} (", text)
            self.assertRegex(text, rf'{name} \([^)]*\): {figure[end]["provenance"]}')
            at = np.array(self.projected(shot, figure[end]['point']))
            self.assertLess(np.abs(at - [right, down]).max(), 1.5, name)

    def projected(self, shot, point):
        """Where a point is on the canvas, from its middle [pixels], by the camera of the file."""
        in_camera = np.array(shot['rotation']).T @ (np.array(point) - shot['position'])
        u, v = [shot[f] * in_camera[k] / in_camera[2] + shot[c] - shot[size] / 2
                for k, (f, c, size) in enumerate((('fx', 'cx', 'width'), ('fy', 'cy', 'height')))]
        size = self.page.canvas().size
        scale = min(size['width'] / shot['width'], size['height'] / shot['height'])
        return scale * u, scale * v

    def test_says_that_invented_surface_has_no_sigma(self):
        canvas = self.page.canvas()
        self.page.click(0, 0)
        for _ in range(36):  # to the back, which no photograph saw
            canvas.send_keys(Keys.ARROW_RIGHT)
        canvas.send_keys(Keys.ENTER)
        self.page.press('Provenance')
        self.page.driver.save_screenshot(str(SCREENS / 'behind.png'))
        self.assertGreater(share_of_magenta(self.page.picture()), 0.2)
        text = self.page.measured()
        self.assertNotIn('±', re.search(r'Distance .*', text).group())
        self.assertRegex(text, r'B \([^)]*\): inferred\. Nothing measured this place')
        figure = measure(re.search(r'cgs measure .*', text).group())
        self.assertIsNone(figure['sigma'])
        self.assertEqual(figure['to']['provenance'], 'inferred')

    def test_what_nothing_measured_can_be_hidden(self):
        canvas = self.page.canvas()
        for _ in range(36):  # to the back, which no photograph saw
            canvas.send_keys(Keys.ARROW_RIGHT)
        self.page.press('Provenance')
        self.assertGreater(share_of_magenta(self.page.picture()), 0.2)
        canvas.send_keys('h')
        self.page.driver.save_screenshot(str(SCREENS / 'without_invented.png'))
        self.assertLess(share_of_magenta(self.page.picture()), 1e-4)  # the cross is of that colour
        canvas.send_keys(Keys.ENTER)  # nothing is there to be picked
        self.assertIn('Pick two points', self.page.measured())
        canvas.send_keys('H')  # as with Caps Lock
        self.assertGreater(share_of_magenta(self.page.picture()), 0.2)
        self.page.press('Surface that nothing measured')
        self.assertLess(share_of_magenta(self.page.picture()), 1e-4)
        self.page.press('Surface that nothing measured')
        self.assertGreater(share_of_magenta(self.page.picture()), 0.2)

    def test_keys_turn_zoom_and_clear(self):
        canvas = self.page.canvas()
        seen = [self.page.picture()]
        for key in (Keys.ARROW_LEFT, Keys.ARROW_UP, '+', '-'):
            canvas.send_keys(key * 3)
            seen.append(self.page.picture())
            self.assertGreater(changed(seen[-2], seen[-1]), 0.05, key)
        canvas.send_keys(Keys.ENTER)
        self.assertIn('Pick the second point', self.page.measured())
        self.assertEqual(len(self.page.driver.find_elements(By.CSS_SELECTOR, '#viewer .end')), 1)
        canvas.send_keys(Keys.ESCAPE)
        self.assertIn('Pick two points', self.page.measured())
        self.assertEqual(self.page.driver.find_elements(By.CSS_SELECTOR, '#viewer .end'), [])

    def test_drag_turns_and_does_not_measure(self):
        before = self.page.picture()
        ActionChains(self.page.driver).move_to_element(self.page.canvas()).click_and_hold().move_by_offset(
            120, 30).release().perform()
        self.assertGreater(changed(before, self.page.picture()), 0.1)
        self.assertIn('Pick two points', self.page.measured())

    def test_section_cuts_and_what_is_cut_off_cannot_be_picked(self):
        whole = self.page.picture()
        axis = Select(self.page.driver.find_element(By.ID, 'viewer-axis'))
        axis.select_by_visible_text('z')
        below = self.page.picture()
        self.page.driver.save_screenshot(str(SCREENS / 'section.png'))
        self.page.press('Other side')
        above = self.page.picture()
        self.assertGreater(changed(whole, below), 0.1)
        self.assertGreater(changed(below, above), 0.1)
        slider = self.page.driver.find_element(By.ID, 'viewer-cut')
        slider.send_keys(Keys.ARROW_LEFT * 200)
        self.assertGreater(changed(above, self.page.picture()), 0.05)
        self.page.press('Other side')
        height = self.page.driver.find_element(By.ID, 'viewer-cut-text').text.split('=')[1].strip()
        picked = set()
        for right in range(-300, 301, 100):
            for down in range(-200, 201, 100):
                self.page.click(right, down)
                picked.update(re.findall(r'[AB] \(([^,]+,[^,]+, [-\d.]+)\)', self.page.measured()))
        self.assertGreaterEqual(len(picked), 5)
        for place in picked:
            self.assertLess(float(place.split(',')[2]), float(height) + 0.51 * 10 ** -decimals(height))
        axis.select_by_visible_text('none')
        self.assertLess(changed(whole, self.page.picture()), 0.01)

    def test_cuts_where_the_controls_that_the_browser_brings_back_say(self):
        driver = self.page.driver
        Select(driver.find_element(By.ID, 'viewer-axis')).select_by_visible_text('z')
        self.page.settle()
        said = driver.find_element(By.ID, 'viewer-cut-text').text
        driver.get('data:text/html,elsewhere')
        driver.back()
        self.page.wait()
        self.addCleanup(lambda: Select(driver.find_element(By.ID, 'viewer-axis')).select_by_visible_text('none'))
        self.assertEqual(driver.find_element(By.ID, 'viewer-axis').get_attribute('value'), 'z')
        self.assertEqual(driver.find_element(By.ID, 'viewer-cut-text').text, said)
        self.assertTrue(driver.find_element(By.ID, 'viewer-cut').is_enabled())

    def test_holes_can_be_laid_over_the_photographs(self):
        # view_08 looks from where no photograph was taken. Its mask is laid over two pictures.
        row = self.page.driver.find_element(By.XPATH, '//h3[starts-with(., "view_08")]/following::div[1]')
        masked = row.find_elements(By.CSS_SELECTOR, '.picture:has(.hole)')
        self.assertEqual(len(masked), 2)
        for view in masked:
            before = pixels(view)
            self.page.driver.find_element(By.ID, 'holes').click()
            after = pixels(view)
            row.screenshot(str(SCREENS / 'holes.png'))
            self.page.driver.find_element(By.ID, 'holes').click()
            mask = Image.open(OUT / 'views/view_08.hole.png').convert('L')
            mask = np.asarray(mask.resize((after.shape[1], after.shape[0]))) / 255
            self.assertEqual(share_of_magenta(before), 0)
            self.assertAlmostEqual(share_of_magenta(after), mask.mean(), delta=0.2 * mask.mean())
            self.assertLess(changed(before[mask == 0], after[mask == 0]), 0.01)


class Film(unittest.TestCase):
    FRAMES = 6

    @classmethod
    def setUpClass(cls):
        cls.folder = FOLDER / 'film'
        subprocess.run([CGS, 'render', OUT / 'model', '--path', 'spiral', '--frames', str(cls.FRAMES), '-q',
                        '-o', cls.folder], check=True)
        cls.driver = browser()
        cls.driver.get((cls.folder / 'film.html').as_uri())

    @classmethod
    def tearDownClass(cls):
        cls.driver.quit()

    def shown(self):
        return next(f for f in self.driver.find_elements(By.CSS_SELECTOR, '#film figure') if f.is_displayed())

    def press(self, key):
        self.driver.find_element(By.TAG_NAME, 'body').send_keys(key)

    def test_tints_at_a_key_what_no_photograph_saw(self):
        before = pixels(self.shown())
        self.press('h')
        after = pixels(self.shown())
        self.driver.save_screenshot(str(SCREENS / 'film.png'))
        self.press('h')
        self.assertEqual(changed(before, pixels(self.shown())), 0)
        picture = self.shown().find_element(By.CSS_SELECTOR, '.picture img')
        height, width = picture.size['height'], picture.size['width']
        own = Image.open(self.folder / 'frame_0000.hole.png').convert('L')
        scale = min(width / own.width, height / own.height)
        size = int(own.width * scale), int(own.height * scale)
        mask = np.asarray(own.resize(size)) > 127
        top, left = (height - size[1]) // 2, (width - size[0]) // 2
        tinted = np.abs(before - after).max(axis=-1)[top:top + size[1], left:left + size[0]] > 0.02
        self.assertGreater(mask.mean(), 0.01)
        self.assertGreater(np.mean(tinted == mask), 0.98)

    def test_goes_by_keys_and_plays(self):
        for key, frame in ((Keys.ARROW_RIGHT, 1), (Keys.ARROW_RIGHT, 2), (Keys.ARROW_LEFT, 1)):
            self.press(key)
            self.assertIn(f'frame_000{frame}: no photograph saw', self.shown().text)
        self.press(' ')
        seen = set()
        for _ in range(100):
            seen.add(self.driver.find_element(By.ID, 'frame').get_attribute('value'))
            time.sleep(0.02)
        self.press(' ')
        self.press(Keys.ARROW_LEFT * self.FRAMES)
        self.assertEqual(seen, {str(k) for k in range(self.FRAMES)})
        self.assertIn('frame_0000', self.shown().text)

    def test_leaves_space_to_what_has_the_focus(self):
        holes = self.driver.find_element(By.ID, 'holes')
        play = self.driver.find_element(By.ID, 'play')
        for ticked in (True, False):
            holes.send_keys(' ')
            self.assertEqual(holes.is_selected(), ticked)
            self.assertEqual(play.get_attribute('aria-pressed'), 'false')
        for pressed in ('true', 'false'):
            play.send_keys(' ')
            self.assertEqual(play.get_attribute('aria-pressed'), pressed)
        self.press(Keys.ARROW_LEFT * self.FRAMES)

    def test_shows_the_frame_of_the_slider_that_the_browser_brings_back(self):
        self.driver.find_element(By.ID, 'frame').send_keys(Keys.ARROW_RIGHT * 3)
        self.addCleanup(self.press, Keys.ARROW_LEFT * self.FRAMES)
        self.driver.get('data:text/html,elsewhere')
        self.driver.back()
        self.assertEqual(self.driver.find_element(By.ID, 'frame').get_attribute('value'), '3')
        self.assertIn('frame_0003', self.shown().text)


class OtherBrowsers(unittest.TestCase):
    def open(self, name, *more, **options):
        page = Page(*more, **options)
        self.addCleanup(page.driver.quit)
        page.driver.save_screenshot(str(SCREENS / f'{name}.png'))
        self.assertEqual(page.severe(), [])
        return page

    def test_dark(self):
        page = self.open('dark', '--blink-settings=preferredColorScheme=0')
        self.assertEqual(page.state(), 'ready')
        self.assertLess(page.picture()[:5].mean(), 0.3)

    def test_phone(self):
        page = self.open('phone', phone=True)
        self.assertEqual(page.state(), 'ready')
        overflow = page.driver.execute_script(
            'return document.documentElement.scrollWidth - document.documentElement.clientWidth')
        self.assertEqual(overflow, 0)
        page.driver.execute_script('arguments[0].scrollIntoView({block: "center"})', page.canvas())
        before = page.picture()
        page.touch(40)
        self.assertGreater(changed(before, page.picture()), 0.1)
        self.assertIn('Pick two points', page.measured())
        page.touch(0)
        self.assertIn('Pick the second point', page.measured())
        page.driver.save_screenshot(str(SCREENS / 'phone_touched.png'))

    def test_large_screen(self):
        page = self.open('large', '--window-size=3840,2160')
        self.assertEqual(page.state(), 'ready')
        self.assertGreater(page.canvas().size['width'], 2000)
        self.assertGreater(page.canvas().size['height'], 1200)

    def test_comes_back_after_the_graphics_context_was_lost(self):
        page = self.open('context')
        before = page.picture()
        page.driver.execute_async_script('''
            const [canvas, done] = arguments;
            const context = canvas.getContext('webgl').getExtension('WEBGL_lose_context');
            canvas.addEventListener('webglcontextlost', () => setTimeout(() => context.restoreContext(), 200));
            canvas.addEventListener('webglcontextrestored', () => setTimeout(done, 1000));
            context.loseContext();''', page.canvas())
        self.assertLess(changed(before, page.picture()), 0.01)

    def test_without_webgl(self):
        page = self.open('no_webgl', '--disable-3d-apis')
        self.assertEqual(page.state(), 'failed')
        self.assertIn('needs WebGL', page.viewer().text)
        self.assertFalse(page.canvas().is_displayed())
        self.assertGreater(len(page.driver.find_elements(By.CSS_SELECTOR, 'figure img')), 8)


def decimals(text):
    return len(text.partition('.')[2])


if __name__ == '__main__':
    try:
        browser().quit()
    except WebDriverException as error:
        print('skipped: the browser cannot be started:', error.msg)
        sys.exit(SKIPPED)
    unittest.main(argv=sys.argv[:1], verbosity=2)
