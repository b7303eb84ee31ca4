// A drag: what the pointer does until it is lifted, or until it is given up, which leaves everything as it was.

export interface Drag {
  moved: (event: PointerEvent) => void;
  dropped: (event: PointerEvent) => void;
  /** Escape was pressed, or the pointer is gone: what was is put back. */
  givenUp: () => void;
}

/** Follows the pointer that `begun` tells of. @param holder  stays on the page while it is dragged. */
export function follow(holder: HTMLElement | SVGElement, begun: PointerEvent, drag: Drag): void {
  const ended = new AbortController(), {signal} = ended;
  const on = (type: "pointermove" | "pointerup" | "pointercancel" | "lostpointercapture", act: (event: PointerEvent) => void) =>
    holder.addEventListener(type, event => {
      const one = event as PointerEvent;
      if (one.pointerId === begun.pointerId) act(one);
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
  window.addEventListener("keydown", event => {
    if (event.key !== "Escape") return;
    event.preventDefault();
    event.stopPropagation();
    giveUp();
  }, {signal, capture: true});
  holder.setPointerCapture(begun.pointerId);
}
