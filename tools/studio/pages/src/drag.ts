// A drag: what the pointer does until it is lifted, or until it is given up, which leaves everything as it was.

export interface Drag {
  moved: (event: PointerEvent) => void;
  dropped: (event: PointerEvent) => void;
  /** Escape or undo was pressed, or the pointer is gone: what was is put back. */
  givenUp: () => void;
}

/** Follows the pointer that `begun` tells of, pressed on `holder`, even if that goes away while it is dragged. */
export function follow(holder: Element, begun: PointerEvent, drag: Drag): void {
  holder.setPointerCapture(begun.pointerId);
  const ended = new AbortController(), {signal} = ended;
  const on = (type: "pointermove" | "pointerup" | "pointercancel" | "lostpointercapture", act: (event: PointerEvent) => void) =>
    document.addEventListener(type, event => {
      if (event.pointerId === begun.pointerId) act(event);
    }, {signal});
  const giveUp = () => {
    ended.abort();
    drag.givenUp();
  };
  on("pointermove", drag.moved);
  on("pointerup", event => {
    ended.abort();
    drag.dropped(event);
  });
  on("pointercancel", giveUp);
  on("lostpointercapture", giveUp);
  document.addEventListener("keydown", event => {
    const undo = (event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z";
    if (event.key !== "Escape" && !undo) return;
    event.preventDefault();
    event.stopPropagation();
    giveUp();
    if (holder.hasPointerCapture(begun.pointerId)) holder.releasePointerCapture(begun.pointerId);
  }, {signal, capture: true});
}
