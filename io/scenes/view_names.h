// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "libcgs/core/scene.h"

namespace cgs {

/// Turns the names that files state for views into file stems, or into whole paths with "_" for "/"
/// where stems would collide. None is there twice then, and each can be printed, stand in JSON and
/// begin the names of output files.
void name_views(Scene& scene);

/// The names of views.
/// \param views  indices into scene.views
std::vector<std::string> view_names(const Scene& scene, const std::vector<int>& views);

/// The first few names, separated by commas, for messages.
std::string first_few(const std::vector<std::string>& names);

/// The views that a word may mean: of that name, else whose file is called so, with or without
/// folders, else the one of that index in name order, among all photographs.
/// \return indices into scene.views; several only for files of one name
std::vector<int> views_called(const Scene& scene, const std::string& word);

/// The index by which views_called() finds a view: in name order, among all photographs.
/// \pre view is an index into scene.views
int index_of(const Scene& scene, int view);

/// The one view that a word means.
/// \param option  that the word was given to, for messages
/// \return index into scene.views
/// \throws InvalidInput if there is none, or more than one
int find_view(const Scene& scene, const std::string& word, const std::string& option);

/// The views a list names: comma-separated file stems or indices in name order, as in
/// SceneOptions::views.
/// \return indices into scene.views, ascending
/// \throws InvalidInput for a view that does not exist or is named twice
std::vector<int> select_views(const Scene& scene, const std::string& list);

/// Whether such a list can hold the name: a comma ends a name there.
bool is_listable(const std::string& name);

/// Refuses the name of a photograph that such a list cannot hold.
/// \param option  that takes the list, for messages
/// \throws InvalidInput unless is_listable()
void require_listable(const std::string& name, const std::string& option);

/// Such a list of names.
/// \pre is_listable() of each
std::string view_list(const std::vector<std::string>& names);

}  // namespace cgs
