/** Opens a file: by its index where it has one, else from front to back. */

import type { Tell } from "./assembly.ts";
import { IndexedRecording, readIndex } from "./indexed.ts";
import type { Recording } from "./recording.ts";
import type { Source } from "./sources.ts";
import { StreamedRecording } from "./streamed.ts";

export interface Opening {
  /** Seconds from the first frame set: what is read first. */
  readonly fromSeconds: number;
  /** Damage, and what was made of it. */
  readonly tell: Tell;
  /** A growing file has more frame sets; without this no file is followed. */
  readonly onGrowth?: () => void;
}

/** Throws FileError. */
export async function openRecording(source: Source, opening: Opening): Promise<Recording> {
  let index: Awaited<ReturnType<typeof readIndex>>;
  try {
    index = await readIndex(source);
  } catch (error) {
    // The data may be whole: they are read from front to back.
    opening.tell(`a damaged index (${(error as Error).message})`);
  }
  if (index !== undefined) return IndexedRecording.open(source, index, opening.fromSeconds, opening.tell);
  return StreamedRecording.open(source, opening.tell, opening.onGrowth);
}
