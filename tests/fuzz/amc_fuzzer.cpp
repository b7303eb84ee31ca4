#include "laban/io/asf_amc.h"

#include "reader_check.h"

namespace {

// The bones of tests/io/asf/good.asf, so that its AMC files are good seeds.
constexpr std::string_view kSkeleton = R"(:units
length 0.45
:root
order TX TY TZ RX RY RZ
:bonedata
begin
name lhipjoint
direction 0.6 -0.8 0
length 2
end
begin
name lfemur
direction 0.34202 -0.939693 0
length 7
axis 0 0 20 XYZ
dof rx ry rz
end
begin
name ltibia
direction 0.34202 -0.939693 0
length 7
axis 0 0 20 XYZ
dof rx
end
begin
name back
direction 0 1 0
length 5
axis 90 30 0 ZYX
dof tx rz ry l
end
begin
name head
direction 0 0.8 0.6
length 3
dof rx
end
:hierarchy
root lhipjoint back
lhipjoint lfemur
lfemur ltibia
back head
)";

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const laban::io::AsfFile skeleton = laban::io::read_asf(kSkeleton, "fuzz.asf");
  return laban::fuzz::check_reader(data, size, [](std::string_view bytes) {
    static_cast<void>(laban::io::read_amc(bytes, "fuzz.amc", skeleton));
  });
}
