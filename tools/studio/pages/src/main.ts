// The studio: rooms behind tabs, files dropped anywhere.
import {getJson, sendFile, type ClipInfo, type Overview} from "./api";
import {button, el, refill, select} from "./dom";
import {EffortRoom} from "./effort_room";
import {LabelRoom} from "./label_room";
import {messageOf, parsedFile} from "./files";
import {LoopRoom} from "./loop_room";
import {MapRoom} from "./map_room";
import {StageRoom} from "./stage_room";
import type {Room, Studio} from "./studio";
import {TextureRoom} from "./texture_room";
import {chooseTheme, theme} from "./theme";
import {WorkBar} from "./work_bar";

class Shell implements Studio {
  clips: ClipInfo[] = [];
  clip: ClipInfo | null = null;
  private readonly head = document.getElementById("head")!;
  private readonly host = document.getElementById("room")!;
  private readonly trouble = document.getElementById("trouble")!;
  private readonly work = new WorkBar(document.getElementById("work")!);
  private rooms: Room[] = [];
  private room: Room | null = null;
  private underWay = 0;
  private troubles = 0;

  async start(): Promise<void> {
    await this.attempt(async () => {
      const overview = await getJson<Overview>("/api/studio");
      this.clips = overview.clips;
      this.clip = this.clips[0] ?? null;
      const made: Record<string, () => Room> = {
        effort: () => new EffortRoom(this), loop: () => new LoopRoom(this),
        texture: () => new TextureRoom(this), map: () => new MapRoom(this), stage: () => new StageRoom(this), label: () => new LabelRoom(this),
      };
      this.rooms = overview.rooms.filter(id => id in made).map(id => made[id]());
      this.listen();
      await this.enter(this.rooms[0]);
    });
  }

  tell(trouble: string): void {
    this.trouble.textContent = trouble;
    this.trouble.hidden = trouble === "";
  }

  async attempt(work: () => Promise<void>): Promise<void> {
    this.host.setAttribute("aria-busy", String(++this.underWay > 0));
    this.work.begin();
    const {troubles} = this;
    try {
      await work();
      // What went wrong in the meantime, in a part of it or beside it, stays to be read.
      if (this.troubles === troubles) this.tell("");
    } catch (error) {
      ++this.troubles;
      this.tell(messageOf(error));
    }
    this.work.end();
    this.host.setAttribute("aria-busy", String(--this.underWay > 0));
  }

  private async enter(room: Room): Promise<void> {
    this.room?.leave();
    this.room = room;
    this.showHead();
    // A place of its own: a room that is left while it opens goes on in one that nobody sees.
    const place = el("div", {class: "place"});
    this.host.replaceChildren(place);
    await this.attempt(() => room.enter(place));
  }

  private showHead(): void {
    const tabs = this.rooms.map(room => {
      const tab = button(room.title, `The ${room.title} room`, () => void this.enter(room));
      if (room === this.room) tab.setAttribute("aria-current", "page");
      return tab;
    });
    const clips = select("Clip", this.clips.map(clip => ({value: clip.id, label: clip.name})), this.clip?.id ?? "", id => {
      this.clip = this.clips.find(clip => clip.id === id) ?? null;
      void this.enter(this.room!);
    });
    const other = theme() === "dark" ? "light" : "dark";
    refill(this.head, el("h1", {}, "laban"), el("nav", {"aria-label": "Rooms"}, ...tabs),
      ...(this.clips.length === 0 ? [] : [clips.root]),
      el("span", {class: "spacer"}),
      button(other === "dark" ? "Dark" : "Light", `Show the pages ${other}`, () => {
        chooseTheme(other);
        this.showHead();
      }));
  }

  private listen(): void {
    document.addEventListener("keydown", event => {
      const target = event.target as HTMLElement;
      const types = target instanceof HTMLTextAreaElement || (target instanceof HTMLInputElement && ["number", "text"].includes(target.type));
      const presses = event.key === " " && target.closest("button, input, select") !== null;
      if (!types && !presses && this.room?.key(event)) event.preventDefault();
    });
    document.addEventListener("dragover", event => event.preventDefault());
    document.addEventListener("drop", event => {
      event.preventDefault();
      void this.take([...event.dataTransfer?.files ?? []]);
    });
  }

  /** Opens files: clips, skeletons before the motion that needs them, states of a room. */
  private async take(files: File[]): Promise<void> {
    const order = (file: File) => file.name.toLowerCase().endsWith(".asf") ? 0 : 1;
    await this.attempt(async () => {
      const wrong: string[] = [];
      for (const file of files.sort((a, b) => order(a) - order(b)))
        await this.takeOne(file).catch(error => wrong.push(messageOf(error)));
      if (wrong.length > 0) throw new Error(wrong.join("; "));
    });
  }

  private async takeOne(file: File): Promise<void> {
    if (file.name.toLowerCase().endsWith(".json")) {
      if (!await this.room!.open?.(await parsedFile(file))) throw new Error(`${file.name}: no state of this room`);
      return;
    }
    const clip = await sendFile(file);
    if (clip === null) return;
    this.clips.push(clip);
    this.clip = clip;
    await this.enter(this.room!);
  }
}

void new Shell().start();
