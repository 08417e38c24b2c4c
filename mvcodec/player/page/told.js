// What is said of a picture: how good it is beside its original, and what is damaged.

export function showQuality(element, quality) {
  element.hidden = !quality;
  if (!quality) return;
  const ssim = quality.ssim === null ? "" : ` · SSIM ${quality.ssim.toFixed(4)}`;
  element.textContent = quality.reason ?? `PSNR ${quality.psnr_db.toFixed(2)} dB${ssim}`;
}

export function damageText({ damage, frame }) {
  const on = damage.goes_on_s === null ? "to the end" : `until ${damage.goes_on_s.toFixed(3)} s`;
  return `Damage: frame ${frame} cannot be decoded (from ${damage.time_s.toFixed(3)} s ${on}); the nearest whole one is shown. ${damage.message}`;
}
