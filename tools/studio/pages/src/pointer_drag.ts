// A pointer that is held down on something: where it goes, and how that ends.

export interface PointerDrag {
  moved: (event: PointerEvent) => void;
  /** It was let go. */
  done: (event: PointerEvent) => void;
  /** It was taken away, or Escape pressed: all is to be as it was. */
  canceled: () => void;
}

/** Follows the pointer that was pressed on an element, even if that goes away while it is held. */
export function followPointer(pressed: PointerEvent, on: Element, drag: PointerDrag): void {
  on.setPointerCapture(pressed.pointerId);
  const over = new AbortController(), {signal} = over;
  const cancel = () => {
    over.abort();
    drag.canceled();
  };
  const listen = (type: "pointermove" | "pointerup" | "pointercancel" | "lostpointercapture", act: (event: PointerEvent) => void) =>
    document.addEventListener(type, event => {
      if (event.pointerId === pressed.pointerId) act(event);
    }, {signal});
  listen("pointermove", drag.moved);
  listen("pointerup", last => {
    over.abort();
    drag.done(last);
  });
  listen("pointercancel", cancel);
  listen("lostpointercapture", cancel);
  document.addEventListener("keydown", event => {
    if (event.key !== "Escape") return;
    event.preventDefault();
    event.stopPropagation();
    cancel();
    if (on.hasPointerCapture(pressed.pointerId)) on.releasePointerCapture(pressed.pointerId);
  }, {signal, capture: true});
}
