// What a user of the installed library writes: reads a clip, finds the person, measures Effort.
#include <cstdio>

#include "laban/base/version.h"
#include "laban/draw/contact_sheet.h"
#include "laban/effort/observer.h"
#include "laban/io/clip_file.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/retarget.h"
#include "laban/transfer/apply_style.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const laban::motion::Capture capture =
      laban::motion::find_capture(laban::io::read_clip(argv[1]).clip);
  const laban::motion::PoseMatrix pose =
      laban::motion::to_pose_matrix(capture.clip, capture.humanoid);
  const laban::effort::Descriptors descriptors = laban::effort::describe(pose);
  std::printf("laban %s: %d frames, quickness %.3f\n", laban::base::version().data(),
              pose.frame_count(), descriptors.time);
  return 0;
}
