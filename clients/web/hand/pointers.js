/* Positions and loads of pointers over an element: mouse, fingers and pen, several at once.

Model: all reports of the device are used, each with its own time, if the browser provides them (`pointerrawupdate`,
coalesced events); otherwise there is one event per picture of the screen.
Limits: a mouse and most screens report no pressure. */

const NOT_REPORTED = new Set([0, 0.5, 1]); // pressures of touch screens that mean "not measured"

/** Follows the pointers over `element`; returns a function that ends this.
 *  metresPerPixel: number or function. loadOf(pressure): returns the load, N; pressure: 0 to 1, null: not reported.
 *  onMove(id, {position, y, load, time}): m from the left edge, m upwards from the middle, N, s of performance.now.
 *  onLift(id). */
export function followPointers(element, { metresPerPixel, loadOf, onMove, onLift }) {
  const touching = new Map(); // id -> time of the last event, ms
  const scale = () => (typeof metresPerPixel === "function" ? metresPerPixel() : metresPerPixel);

  const tell = (event, { left, top, height }) => {
    const last = touching.get(event.pointerId);
    if (last === undefined || event.timeStamp <= last) return; // two kinds of event have the same report
    touching.set(event.pointerId, event.timeStamp);
    const position = (event.clientX - left) * scale();
    const y = (top + height / 2 - event.clientY) * scale();
    onMove(event.pointerId, { position, y, load: loadOf(pressureOf(event)), time: event.timeStamp / 1e3 });
  };
  const down = (event) => {
    if (event.button !== 0 || touching.has(event.pointerId)) return;
    try {
      element.setPointerCapture(event.pointerId); // otherwise a stroke ends at the edge of the element
    } catch {
      /* the pointer is already gone */
    }
    touching.set(event.pointerId, -Infinity);
    tell(event, element.getBoundingClientRect());
  };
  const move = (event) => {
    if (!touching.has(event.pointerId)) return;
    const box = element.getBoundingClientRect();
    const parts = event.getCoalescedEvents?.() ?? [];
    for (const part of parts.length ? parts : [event]) tell(part, box);
  };
  const lift = (event) => {
    if (touching.delete(event.pointerId)) onLift(event.pointerId);
  };
  const handlers = {
    pointerdown: down,
    pointermove: move,
    pointerrawupdate: move,
    pointerup: lift,
    pointercancel: lift,
    lostpointercapture: lift,
  };
  const touchAction = element.style.touchAction;
  element.style.touchAction = "none"; // otherwise a stroke scrolls the page
  for (const [type, handler] of Object.entries(handlers)) element.addEventListener(type, handler);
  return () => {
    element.style.touchAction = touchAction;
    for (const [type, handler] of Object.entries(handlers)) element.removeEventListener(type, handler);
    for (const id of touching.keys()) onLift(id);
    touching.clear();
  };
}

function pressureOf({ pointerType, pressure }) {
  const reported = pointerType === "pen" ? pressure > 0 : pointerType === "touch" && !NOT_REPORTED.has(pressure);
  return reported ? pressure : null;
}
