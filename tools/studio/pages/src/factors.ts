// The Effort factors and the names of their poles, from the indulging to the condensing one.

export interface Poles {
  title: string;
  low: string;
  high: string;
}

export const POLES: Record<string, Poles> = {
  flow: {title: "Flow", low: "Free", high: "Bound"},
  weight: {title: "Weight", low: "Light", high: "Strong"},
  time: {title: "Time", low: "Sustained", high: "Sudden"},
  space: {title: "Space", low: "Indirect", high: "Direct"},
};

export const LIMIT = 3;
