/** Numbers as people read them. */

/** `0:00.9`, `1:02:03.4`. */
export function timeText(seconds: number): string {
  const tenths = Math.max(Math.floor(seconds * 10 + 1e-6), 0);
  const [hours, minutes] = [Math.floor(tenths / 36000), Math.floor(tenths / 600) % 60];
  const rest = `${String(Math.floor(tenths / 10) % 60).padStart(2, "0")}.${tenths % 10}`;
  return hours > 0 ? `${hours}:${String(minutes).padStart(2, "0")}:${rest}` : `${minutes}:${rest}`;
}

export function bytesText(bytes: number): string {
  return bytes < 1e6 ? `${Math.ceil(bytes / 1e3)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}

/** `0.5,1.25` -> a viewpoint; undefined where it is none. */
export function parseView(text: string | null): { row: number; col: number } | undefined {
  const parts = (text ?? "").split(",").map((part) => (part.trim() === "" ? NaN : Number(part)));
  return parts.length === 2 && parts.every(Number.isFinite) ? { row: parts[0], col: parts[1] } : undefined;
}

export function viewText(view: { row: number; col: number }): string {
  const short = (value: number) => String(Math.round(value * 1000) / 1000);
  return `${short(view.row)},${short(view.col)}`;
}
