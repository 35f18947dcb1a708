// SPDX-License-Identifier: GPL-3.0-or-later
//
// Plays the frames of film.html, there and back, and acts on its keys.
'use strict';
(() => {
  const MILLISECONDS = 1000 / 24;
  const frames = document.querySelectorAll('#film figure');
  const slider = document.getElementById('frame');
  const play = document.getElementById('play');
  const holes = document.getElementById('holes');
  let shown = 0;
  let step = 1;
  let timer = null;

  function show(frame) {
    frames[shown].hidden = true;
    shown = Math.min(Math.max(frame, 0), frames.length - 1);
    frames[shown].hidden = false;
    slider.value = shown;
  }
  function next() {
    if (shown + step < 0 || shown + step >= frames.length) step = -step;
    show(shown + step);
  }
  function pause() {
    clearInterval(timer);
    timer = null;
    play.setAttribute('aria-pressed', false);
  }
  function toggle() {
    if (timer) return pause();
    timer = setInterval(next, MILLISECONDS);
    play.setAttribute('aria-pressed', true);
  }
  function stepBy(count) {
    pause();
    show(shown + count);
  }

  slider.max = frames.length - 1;
  slider.addEventListener('input', () => {
    pause();
    show(Number(slider.value));
  });
  // Browsers bring back where it stood before.
  window.addEventListener('pageshow', () => show(Number(slider.value)));
  play.addEventListener('click', toggle);
  const keys = {
    h: () => holes.click(), ' ': toggle,
    ArrowLeft: () => stepBy(-1), ArrowRight: () => stepBy(1),
  };
  document.addEventListener('keydown', (event) => {
    const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act || event.ctrlKey || event.altKey || event.metaKey) return;
    // Space ticks and presses what has the focus.
    if (event.key === ' ' && event.target.closest('button, input[type=checkbox]')) return;
    event.preventDefault();
    act();
  });
})();
