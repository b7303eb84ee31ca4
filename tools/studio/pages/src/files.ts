// Files that were chosen or dropped, and what is said of them.

export function messageOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

/** What a JSON file holds. @throws naming the file if it is none. */
export async function parsedFile(file: File): Promise<unknown> {
  try {
    return JSON.parse(await file.text());
  } catch (error) {
    throw new Error(`${file.name}: ${messageOf(error)}`);
  }
}
