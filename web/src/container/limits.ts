/** How much a file may ask for, before memory is taken for it; the same as the Python reader's limits. */
export const LIMITS = {
  /** A record as stored, hence a packed chunk; bytes. */
  recordBytes: 1 << 28,
  /** A chunk, unpacked; bytes. */
  chunkBytes: 1 << 28,
  /** The summary of a file; bytes. */
  indexBytes: 1 << 27,
  /** A header, as JSON text; bytes. */
  headerBytes: 1 << 20,
  /** Real cameras. */
  cameras: 1024,
  /** Views of the dense grid. */
  views: 1 << 16,
  /** Pixels of a frame set: of one picture, times the real cameras. */
  setPixels: 1 << 28,
} as const;

/** A file that cannot be used, in one line. */
export class FileError extends Error {
  override readonly name = "FileError";

  constructor(found: string, expected: string) {
    super(`found ${found}, expected ${expected}`);
  }
}

/** Refuse what is larger than the limit of that name. */
export function checkLimit(limit: keyof typeof LIMITS, size: number | bigint, what: string): void {
  if (size > LIMITS[limit]) throw new FileError(`${what}: ${size}`, `at most ${LIMITS[limit]}`);
}
