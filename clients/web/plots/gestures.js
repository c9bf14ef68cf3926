/* Cursor and zoom of a plot by mouse, touch and keys.

Model: a mouse that moves, or a finger that touches, moves the cursor. Two fingers, and the wheel with Ctrl, zoom. On
the keyboard the arrows move the cursor by a point, with Shift by ten; + and - zoom; 0 shows the whole plot; Escape
removes the cursor.
Limits: the wheel alone scrolls the page. */

const FAR = 10; // points per arrow key with Shift
const STEPS = { ArrowLeft: -1, ArrowRight: 1, Home: -Infinity, End: Infinity };

/** Lets pointers and keys on `element` move the cursor of `panel`. freeze(): freezes a live plot, which a zoom needs. */
export function followGestures(element, panel, freeze) {
  const touches = new Map(); // of fingers: pointer -> x, CSS px
  const left = ({ clientX }) => clientX - element.getBoundingClientRect().left;
  const zoom = (factor) => {
    freeze();
    panel.zoom(factor);
  };
  const down = (event) => {
    if (event.pointerType === "touch") touches.set(event.pointerId, left(event));
    panel.point(left(event));
  };
  const move = (event) => {
    const before = touches.get(event.pointerId);
    if (touches.size === 2 && before !== undefined) {
      const [other] = [...touches].filter(([id]) => id !== event.pointerId).map(([, x]) => x);
      const factor = Math.abs(left(event) - other) / Math.max(1, Math.abs(before - other));
      if (factor > 0) zoom(factor);
    }
    if (before !== undefined) touches.set(event.pointerId, left(event));
    if (touches.size < 2) panel.point(left(event));
  };
  const up = ({ pointerId }) => touches.delete(pointerId);
  const key = (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { key: name } = event;
    if (name in STEPS) panel.step(STEPS[name] * (event.shiftKey ? FAR : 1));
    else if (name === "+" || name === "=") zoom(2);
    else if (name === "-") zoom(0.5);
    else if (name === "0") panel.whole();
    else if (name === "Escape") panel.point(null);
    else return;
    event.preventDefault();
  };
  const wheel = (event) => {
    if (!event.ctrlKey) return;
    event.preventDefault();
    panel.point(left(event));
    zoom(2 ** (-event.deltaY / 200));
  };
  const leave = ({ pointerType }) => pointerType === "mouse" && panel.point(null);
  const all = {
    ...{ pointerdown: down, pointermove: move, pointerup: up, pointercancel: up, pointerleave: leave, keydown: key },
  };
  for (const [type, act] of Object.entries(all)) element.addEventListener(type, act);
  element.addEventListener("wheel", wheel, { passive: false });
  return (event) => all[event.type]?.(event);
}
