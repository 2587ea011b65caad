// Canvas: one that stays crisp at any size and on any screen.

/** Keeps `drawing.canvas` at the screen's own pixels, and its size in `drawing.width`, `.height`. */
export function fitted(drawing, onResize = () => {}) {
  const { canvas, context } = drawing;
  const fit = () => {
    const ratio = window.devicePixelRatio || 1;
    drawing.width = canvas.clientWidth;
    drawing.height = canvas.clientHeight;
    canvas.width = Math.round(drawing.width * ratio);
    canvas.height = Math.round(drawing.height * ratio);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    onResize();
  };
  new ResizeObserver(fit).observe(canvas);
  fit();
}
