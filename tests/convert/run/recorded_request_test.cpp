// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/recorded_request.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "convert/run/request_fields.h"
#include "libcgs/core/error.h"
#include "tests/support/temp_dir.h"

namespace cgs::recorded_request_test {
namespace {

using Json = nlohmann::ordered_json;

// Every setting differs from its default; whole numbers and fractions take another digit.
TrainingOptions unusual_training() {
  TrainingOptions out;
  for (const auto& [name, value] : training_fields(out)) {
    if (value.find_first_not_of("0123456789.,e-") != std::string::npos) continue;
    set_training_field(out, name, value + "1");
  }
  out.coherence.decoder = ResidualDecoder::Conv;
  return out;
}

RunRequest unusual_request(const test::TempDir& dir) {
  test::write_bytes(dir / "survey.csv", "name,x,y,z\n");
  test::write_bytes(dir / "net.onnx", "a network");
  RunRequest out;
  out.scene.path = dir.path();
  out.scene.options.views = "a,b";
  out.scene.options.downscale = 3;
  out.scene.options.depth = {dir / "depth", DepthKind::Disparity, dir / "net.onnx", 5000};
  out.scene.focal = 1234.5;
  out.scene.assume_unit = "ft";
  out.scene.up = {0, 0.6, 0.8};
  out.scene.refine_poses = true;
  out.scene.known_distances = {{"a:1,2", "b:3,4", "1m"}, {"a:5,6", "b:7,8", "2m+-1cm"}};
  out.scene.marker_size = "80mm";
  out.scene.control = {dir / "survey.csv", "cm"};
  out.training = unusual_training();
  out.medium = Medium::Water;
  out.voxel_size = "5mm";
  out.simplify = "2mm";
  out.compression_error = "1mm";
  out.max_error = "3mm";
  out.max_size = 123456;
  out.fill = HoleFill::None;
  out.local_origin = true;
  out.lods = 2;
  out.glb_encoding = GlbEncoding::Quantized;
  out.texture = "atlas=2mm";
  out.estimated = EstimatedSurface::Drop;
  return out;
}

// As run_pipeline() notes it.
Json record_of(const RunRequest& request) {
  Json out = {{"request", request_json(request, Scene())}, {"outputs", Json::object()}};
  for (const RequestField& field : noted_fields()) out[field.key] = field.write(request, Scene());
  return out;
}

TEST(RecordedRequest, IsTheOneThatWasMade) {
  const test::TempDir dir;
  for (const RunRequest& request : {unusual_request(dir), RunRequest()}) {
    const Json record = record_of(request);
    const RunRequest found = recorded_request(record, "run.json");
    EXPECT_EQ(record_of(found).dump(), record.dump());
    EXPECT_EQ(training_fields(found.training), training_fields(request.training));
    EXPECT_EQ(found.scene.options.depth.kind, request.scene.options.depth.kind);
    EXPECT_EQ(found.estimated, request.estimated);
  }
}

TEST(RecordedRequest, OfAnotherShapeIsRefused) {
  const test::TempDir dir;
  const Json record = record_of(unusual_request(dir));
  for (const char* key :
       {"up", "known_distances", "max_size", "glb_encoding", "lods", "estimated"}) {
    Json damaged = record;
    damaged["request"][key] = "nothing of the kind";
    EXPECT_THROW(recorded_request(damaged, "run.json"), BadInput) << key;
  }
  Json unknown = record;
  unknown["request"]["training"]["depth_of_thought"] = "1";
  EXPECT_THROW(recorded_request(unknown, "run.json"), InvalidInput);
}

}  // namespace
}  // namespace cgs::recorded_request_test
