// The server's side of the rooms. Every request carries the token that the page was opened with.
import {decodeMotion, type Motion} from "./motion";

const token = new URLSearchParams(location.search).get("token") ?? "";

export class ServerError extends Error {}

async function ask(path: string, init: RequestInit = {}): Promise<Response> {
  let answer: Response;
  try {
    answer = await fetch(path, {...init, headers: {"X-Laban-Token": token}, cache: "no-store"});
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    throw new ServerError("the studio does not answer; is 'laban studio' still running?");
  }
  if (answer.ok) return answer;
  const told = await answer.json().catch(() => ({error: answer.statusText})) as {error: string};
  throw new ServerError(told.error);
}

export async function getJson<T>(path: string): Promise<T> {
  return await (await ask(path)).json() as T;
}

export async function postJson<T>(path: string, body: unknown): Promise<T> {
  return await (await ask(path, {method: "POST", body: JSON.stringify(body)})).json() as T;
}

export async function getMotion(path: string): Promise<Motion> {
  return decodeMotion(await (await ask(path)).arrayBuffer());
}

export async function postMotion(path: string, body: unknown): Promise<Motion> {
  return decodeMotion(await (await ask(path, {method: "POST", body: JSON.stringify(body)})).arrayBuffer());
}

export async function getBytes(path: string): Promise<ArrayBuffer> {
  return await (await ask(path)).arrayBuffer();
}

export interface WorkTold {
  busy: boolean;
  seconds: number;
  /** Done so far, 0 to 1; null where that is not known. */
  fraction: number | null;
}

export async function workTold(): Promise<WorkTold> {
  return await getJson<WorkTold>("/api/work");
}

/** Stops what the studio works on; it then fails with "interrupted". */
export async function stopWork(): Promise<void> {
  await ask("/api/work", {method: "DELETE"});
}

export interface FileAnswer {
  name: string;
  content: Blob;
}

export async function postForFile(path: string, body: unknown): Promise<FileAnswer> {
  const answer = await ask(path, {method: "POST", body: JSON.stringify(body)});
  const name = /filename="([^"]+)"/.exec(answer.headers.get("Content-Disposition") ?? "")?.[1];
  return {name: name ?? "clip", content: await answer.blob()};
}

export interface ClipInfo {
  id: string;
  name: string;
  path: string;
  has_mesh: boolean;
}

/** Sends a file; the clip that it holds, or nothing for an .asf, which waits for its .amc. */
export async function sendFile(file: File): Promise<ClipInfo | null> {
  const path = "/api/clips?name=" + encodeURIComponent(file.name);
  const told = await (await ask(path, {method: "POST", body: file})).json() as ClipInfo | {skeleton: string};
  return "id" in told ? told : null;
}

export interface Overview {
  version: string;
  rooms: string[];
  clips: ClipInfo[];
}

export type Numbers = Record<string, number>;

export interface Lock {
  snippet: number;
  fragments: [string, string];
  alpha: number;
}

/** What the Effort room is set to; `laban apply --state` takes it as a file. */
export interface EffortState {
  schema: string;
  input: string;
  model: string;
  asked: Record<string, number | null>;
  relative: boolean;
  weights: number[];
  detail: "replace" | "residual";
  strength: number;
  keep_timing: boolean;
  foot_fix: boolean;
  stay: number;
  way: number;
  locks: Lock[];
}

export interface InputSnippet {
  begin_s: number;
  end_s: number;
  content: string;
  matches: boolean;
  match_cost: number;
  match_threshold: number | null;
  before: Numbers;
}

export interface OpenedEffort {
  factors: string[];
  model: {name: string; contents: string[]; frame_rate_hz: number; labels_measured: boolean};
  state: EffortState;
  snippets: InputSnippet[];
}

export interface StyledSnippet {
  output_begin_frame: number;
  output_end_frame: number;
  content: string | null;
  kept_as_captured: boolean;
  asked: Record<string, number | null>;
  fragment_i?: string;
  fragment_j?: string;
  alpha?: number;
  fragments?: {fragment: string; weight: number}[];
  predicted?: Numbers;
  predicted_standard_error?: Numbers | null;
  reachable?: Record<string, [number, number]>;
  measured_before: Numbers;
  measured: Numbers;
}

export interface StyleReport {
  snippets: StyledSnippet[];
  quality?: Record<string, number | null>;
}

export interface SnippetChoices {
  played: StyledSnippet;
  runners_up: {fragments: [string, string]; alpha: number; predicted: Numbers; distance: number}[];
  curves: {
    fragments: [string, string];
    alphas: number[];
    predicted: Record<string, number[]>;
    error: Record<string, number[]> | null;
  } | null;
}

export interface OverTime {
  seconds: number[];
  effort: Record<string, (number | null)[]>;
}
