// A moment that plays: of one run, or of two side by side.

/**
 * Plays from now() to the end, in real time; what is longer than a minute within one.
 * show: takes a moment [s]. Returns {toggle, stop, onKey}; onKey takes an event and what moves by steps.
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
  const toggle = () => timer === null ? play() : stop();
  /** Space plays; arrows move by a step, with shift by ten; Home and End move by all there are. */
  function onKey(event, move) {
    const {key, target} = event, isOther = target.tagName === 'BUTTON' && target !== button;
    if (event.ctrlKey || event.altKey || event.metaKey || target.tagName === 'SUMMARY' || isOther) return;
    if (target.tagName === 'CANVAS' && key.startsWith('Arrow')) return;  // turns the scene
    const step = event.shiftKey ? 10 : 1;
    const steps = {ArrowLeft: -step, ArrowRight: step, Home: -Infinity, End: Infinity}[key];
    if (key === ' ') toggle();
    else if (steps) { stop(); move(steps); }
    else return;
    event.preventDefault();
    event.stopPropagation();
  }
  return {toggle, stop, onKey};
}
