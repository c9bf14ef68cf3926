/* Fingers from pointers: mouse, touch and pen over an element, several at once, as positions and loads.

Events come as often as the device reports, where the browser tells so (`pointerrawupdate`, coalesced events), each with
its own time, and not once a picture.
Limits: positions are as fine as the browser gives them. A mouse has no pressure, and most screens report none: the load
is then the slider's. */

const NOT_REPORTED = new Set([0, 0.5, 1]); // pressures of a touch that stand for "none is measured"

/** Follows the pointers over `element`; returns a function that ends it.
 *  metresPerPixel: m, a number or a function. loadOf(pressure): N, of a pressure 0 to 1, null where none is reported.
 *  onMove(id, {position, load, time}): m from the left edge, N, s (of performance.now). onLift(id). */
export function followPointers(element, { metresPerPixel, loadOf, onMove, onLift }) {
  const touching = new Map(); // id -> time of the last event, ms
  const scale = () => (typeof metresPerPixel === "function" ? metresPerPixel() : metresPerPixel);

  const tell = (event, left) => {
    const last = touching.get(event.pointerId);
    if (last === undefined || event.timeStamp <= last) return; // the same report, by two kinds of event
    touching.set(event.pointerId, event.timeStamp);
    const position = (event.clientX - left) * scale();
    onMove(event.pointerId, { position, load: loadOf(pressureOf(event)), time: event.timeStamp / 1e3 });
  };
  const down = (event) => {
    if (event.button !== 0 || touching.has(event.pointerId)) return;
    try {
      element.setPointerCapture(event.pointerId); // else a stroke ends at the edge of the element
    } catch {
      /* a pointer that is already gone */
    }
    touching.set(event.pointerId, -Infinity);
    tell(event, element.getBoundingClientRect().left);
  };
  const move = (event) => {
    if (!touching.has(event.pointerId)) return;
    const { left } = element.getBoundingClientRect();
    const parts = event.getCoalescedEvents?.() ?? [];
    for (const part of parts.length ? parts : [event]) tell(part, left);
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
  element.style.touchAction = "none"; // else the browser takes a stroke for scrolling
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
