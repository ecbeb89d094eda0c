// A moment that plays: of one run, or of two side by side.

/**
 * Plays from now() to the end, in real time; what is longer than a minute within one.
 * show: takes a moment [s]. Returns {toggle, stop}.
 */
function playback(button, duration, now, show) {
  let timer = null;
  function stop() {
    cancelAnimationFrame(timer);
    timer = null;
    button.textContent = '▶';
    button.setAttribute('aria-label', 'play');
  }
  function play() {
    const from = now() < duration ? now() : 0, speed = Math.max(1, duration / 60);
    let begin = null;
    const step = at => {
      if (begin === null) begin = at;
      const t = Math.min(from + speed * (at - begin) / 1000, duration);
      show(t);
      if (t < duration) timer = requestAnimationFrame(step);
      else stop();
    };
    button.textContent = '❚❚';
    button.setAttribute('aria-label', 'pause');
    timer = requestAnimationFrame(step);
  }
  return {toggle: () => timer === null ? play() : stop(), stop};
}
