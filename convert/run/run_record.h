// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace cgs {

/// OUT/run.json: what was asked for, what went in, and which stages are done. It is rewritten
/// after every stage, so an interrupted run resumes where it stopped.
class RunRecord {
 public:
  /// Opens the record of `folder`, or begins one if there is none.
  ///
  /// `request` is everything that decides the result: arguments and hashes of the input files.
  /// \param decides  for keys of the request, the first stage that depends on them; on others all
  ///                 depend
  /// \throws InvalidInput if the folder holds another request's results and `overwrite` is not set;
  ///         with it, the stages whose results would differ are forgotten, and their files removed:
  ///         the new ones may have other names.
  RunRecord(std::filesystem::path folder,
            nlohmann::ordered_json request,
            bool overwrite,
            const std::map<std::string, std::string>& decides = {});

  /// True if the stage was finished, and each of these files and of those it wrote is there.
  bool is_done(const std::string& stage, const std::vector<std::string>& files) const;
  /// What the stage reported when it finished; null if it did not.
  nlohmann::ordered_json result(const std::string& stage) const;
  /// How long a finished stage took [s].
  /// \pre it is in the record
  double seconds(const std::string& stage) const;
  /// Files that a finished stage wrote, as paths below the folder.
  std::vector<std::string> files(const std::string& stage) const;
  /// Those of them that are not what they were then.
  std::vector<std::string> changed_files(const std::string& stage) const;
  /// What all stages wrote, with hashes: {"web/asset.glb": "0123456789abcdef", …}.
  nlohmann::ordered_json file_hashes() const;
  /// Records a finished stage. Stages after it, done from older data, are forgotten.
  /// \param files  what it wrote, as paths below the folder; those of an earlier stage stay that
  ///               stage's, with the hashes that they have now
  void finish(const std::string& stage,
              double seconds,
              const nlohmann::ordered_json& result,
              const std::set<std::string>& files = {});

  /// Keeps something else that is known of the run beside its stages; finish() forgets "outputs".
  void note(const std::string& key, const nlohmann::ordered_json& value);

  const nlohmann::ordered_json& json() const { return json_; }

 private:
  void save() const;

  std::filesystem::path folder_;
  nlohmann::ordered_json json_;
};

/// The record in such a file: an object with "request" and with "stages", of which each has
/// "seconds", "peak_memory" and "result", and "files" with their hashes if it wrote any; null if
/// the file holds none.
nlohmann::ordered_json read_run_record(const std::filesystem::path& path);

}  // namespace cgs
