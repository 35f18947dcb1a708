#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""A run that loses power at any moment leaves nothing that is torn, and goes on to the files of one that did not.

usage: power_loss_test.py CGS CGS_MAKE_CAPTURE FOLDER

Follows what a run asks the system for in its folder, and after every call imagines the two disks that a power cut may
leave: one that kept nothing but what was forced onto it (fsync of a file: its content; of a folder: its names), and one
that kept all names, but of content that was not forced only the first half. Every disk on which something else lies is
written into a folder, and `cgs run` goes on there. CGS_FAULTS says on how many of them; a dozen if nothing is said.

A folder counts as kept with the first file that is kept in it, as journals of file systems do.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

CGS, MAKE_CAPTURE, FOLDER = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
WHOLE, OUT = FOLDER / 'whole', FOLDER / 'out'
CALLS = 'openat,write,pwrite64,lseek,fsync,rename,unlink,close'
STATES_TIMES = 'run.json', 'report.json', 'report.html'  # of these only the name counts


def command(out):
    return [CGS, 'run', FOLDER / 'capture', '--views', 'view_01,view_02,view_03', '--assume-unit', 'm', '--voxel-size',
            '40cm', '--simplify', '0', '--set', 'steps=3', '--threads', '1', '-q', '-o', out]


def traced_calls():
    """(call, arguments, result) of a whole run, in the order in which they ended; text is in hexadecimal digits."""
    log = FOLDER / 'calls'
    subprocess.run(['strace', '-f', '-xx', '-s', '100000000', '-e', 'trace=' + CALLS, '-o', log, *command(WHOLE)],
                   check=True)
    begun = {}
    with open(log) as lines:
        for line in lines:
            thread, _, rest = line.rstrip('\n').partition(' ')
            rest = rest.lstrip()
            if rest.endswith('<unfinished ...>'):
                begun[thread] = rest.removesuffix('<unfinished ...>').rstrip()
                continue
            if rest.startswith('<... '):
                rest = begun.pop(thread) + rest.partition('resumed>')[2]
            parts = re.match(r'(\w+)\((.*)\)\s+= (-?\d+)', rest)
            if parts:
                yield parts[1], parts[2], int(parts[3])


def texts(arguments):
    return [bytes.fromhex(text.replace('\\x', '')) for text in re.findall(r'"([^"]*)"', arguments)]


class File:
    """Its content as programs see it, and as the disk has it."""

    def __init__(self):
        self.content, self.forced = bytearray(), None

    def disk(self, keeps_more):
        if self.forced is not None and self.forced == self.content:
            return bytes(self.content)
        return bytes(self.content[:len(self.content) // 2]) if keeps_more else bytes(self.forced or b'')


class Disk:
    def __init__(self, folder):
        self.folder = str(folder)
        self.names = {}   # path: File, as programs see it
        self.forced = {}  # as the disk has it
        self.open = {}    # descriptor: [File or None for a folder, position, path]
        self.torn = set()  # files that got their name before their content was forced

    def follow(self, call, arguments, result):
        """Whether this may have changed what lies on the disk."""
        if call == 'openat' and result >= 0:
            path = os.path.abspath(texts(arguments)[0].decode())
            if not path.startswith(self.folder):
                return False
            if 'O_DIRECTORY' in arguments:
                self.open[result] = [None, 0, path]
                return False
            if 'O_CREAT' in arguments and path not in self.names:
                self.names[path] = File()
            file = self.names.get(path, File())
            if 'O_TRUNC' in arguments:
                file.content = bytearray()
            self.open[result] = [file, 0, path]
            return 'O_CREAT' in arguments
        descriptor = int(arguments.split(',')[0]) if re.match(r'\d+', arguments) else None
        if descriptor in self.open and result >= 0:
            return self.follow_open(call, descriptor, arguments, result)
        if call in ('rename', 'unlink') and result == 0:
            return self.follow_name(call, [os.path.abspath(text.decode()) for text in texts(arguments)])
        return False

    def follow_open(self, call, descriptor, arguments, result):
        file, position, path = self.open[descriptor]
        if call == 'close':
            del self.open[descriptor]
        elif call == 'lseek':
            self.open[descriptor][1] = result
        elif call in ('write', 'pwrite64'):
            at = int(arguments.rsplit(',', 1)[1]) if call == 'pwrite64' else position
            data = texts(arguments)[0][:result]
            file.content.extend(bytes(max(0, at - len(file.content))))
            file.content[at:at + len(data)] = data
            if call == 'write':
                self.open[descriptor][1] += len(data)
            return True
        elif call == 'fsync' and file is None:
            within = {name: f for name, f in self.names.items() if os.path.dirname(name) == path}
            self.forced = {name: f for name, f in self.forced.items() if os.path.dirname(name) != path} | within
            return True
        elif call == 'fsync':
            file.forced = bytes(file.content)
            return True
        return False

    def follow_name(self, call, paths):
        if not paths[0].startswith(self.folder) or paths[0] not in self.names:
            return False
        file = self.names.pop(paths[0])
        if call == 'rename':
            self.names[paths[1]] = file
            if file.forced != file.content:
                self.torn.add(paths[1])
        return True

    def state(self, keeps_more):
        names = self.names if keeps_more else self.forced
        return {os.path.relpath(name, self.folder): file.disk(keeps_more) for name, file in names.items()}


def files_of(folder):
    return {str(path.relative_to(folder)): b'' if path.name in STATES_TIMES else path.read_bytes()
            for path in folder.rglob('*') if path.is_file()}


def is_unfinished(name):
    return '.part' in name or '.checkpoint' in name


def put(state):
    shutil.rmtree(OUT, ignore_errors=True)
    for name, content in state.items():
        path = OUT / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


class PowerLoss(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(FOLDER, ignore_errors=True)
        FOLDER.mkdir(parents=True)
        subprocess.run([MAKE_CAPTURE, FOLDER / 'capture', '--downscale', '14', '--views', 'view_01,view_02,view_03'],
                       check=True, stdout=subprocess.DEVNULL)
        cls.disk = Disk(WHOLE)
        cls.states = []
        known = set()
        for call in traced_calls():
            if not cls.disk.follow(*call):
                continue
            for keeps_more in (False, True):
                state = cls.disk.state(keeps_more)
                key = hash(frozenset(state.items()))
                if key not in known:
                    known.add(key)
                    cls.states.append(state)
        cls.expected = files_of(WHOLE)

    def test_what_programs_see_in_the_end_is_what_was_followed(self):
        followed = self.disk.state(keeps_more=True)
        self.assertEqual(set(followed), set(self.expected))
        for name, content in self.expected.items():
            if os.path.basename(name) not in STATES_TIMES:
                self.assertEqual(followed[name], content, name)

    def test_no_file_gets_its_name_before_its_content_is_on_the_disk(self):
        self.assertEqual(self.disk.torn, set())

    def test_what_is_there_is_whole_and_a_run_goes_on_from_it(self):
        share = min(len(self.states), int(os.environ.get('CGS_FAULTS', '12')))
        survived = 0
        for i in range(share):
            state = self.states[i * len(self.states) // share]
            for name, content in state.items():
                if not is_unfinished(name) and os.path.basename(name) not in STATES_TIMES:
                    self.assertEqual(content, self.expected[name], f'{name} is torn on disk {i}')
            put(state)
            result = subprocess.run(command(OUT), capture_output=True, text=True)
            with self.subTest(disk=i):
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertTrue(files_of(OUT) == self.expected, 'other files than those of a run that was not cut off')
                survived += 1
        print(f'\npower cuts: {survived} survived of {share} tried, {len(self.states)} disks', flush=True)
        self.assertGreater(len(self.states), 100)


if __name__ == '__main__':
    if shutil.which('strace') is None or subprocess.run(['strace', '-o', '/dev/null', 'true'],
                                                        stderr=subprocess.DEVNULL).returncode != 0:
        print('no strace here, or it may not trace')
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
