// What viewers take with them: a picture, a link.

export function savePicture(canvas, name) {
  canvas.toBlob((blob) => {
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: `${name}.png` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }, "image/png");
}

// Tells what came of it: browsers allow it on secure pages only.
export function copyLink(hash, tell) {
  const address = new URL(hash, location.href).href;
  const isDone = navigator.clipboard ? navigator.clipboard.writeText(address) : Promise.reject(new Error("no clipboard"));
  isDone.then(() => tell("Link copied"), () => tell(address));
}
