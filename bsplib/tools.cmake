# bspcc, bspcxx, bsprun, bsp2-profile and the man pages: for the build folder, and for the installation.
set(tools_dir ${CMAKE_CURRENT_BINARY_DIR})
if(CMAKE_RUNTIME_OUTPUT_DIRECTORY)
  set(tools_dir ${CMAKE_RUNTIME_OUTPUT_DIRECTORY})
endif()

execute_process(COMMAND ${MPIEXEC_EXECUTABLE} --version OUTPUT_VARIABLE mpirun_version ERROR_VARIABLE mpirun_version)
if(mpirun_version MATCHES "Open MPI|OpenRTE|open-mpi")
  set(BSPRUN_FLAGS --oversubscribe)  # more processes than cores are allowed
  set(BSPRUN_EXPORT -x)
endif()

# bsp2_tool(<template> <name>): from the build folder it finds headers and library by their paths here, installed by its own place.
function(bsp2_tool template name)
  set(BSPCC_INCLUDE ${CMAKE_CURRENT_SOURCE_DIR}/include)
  set(BSPCC_LIB ${CMAKE_CURRENT_BINARY_DIR})
  configure_file(tools/${template} ${tools_dir}/${name} @ONLY FILE_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ
    GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
  file(RELATIVE_PATH include_from_bin ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_INCLUDEDIR})
  file(RELATIVE_PATH lib_from_bin ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
  set(BSPCC_INCLUDE "$(readlink -f -- \"$here/${include_from_bin}\")")
  set(BSPCC_LIB "$(readlink -f -- \"$here/${lib_from_bin}\")")
  configure_file(tools/${template} ${CMAKE_CURRENT_BINARY_DIR}/to_install/${name} @ONLY)
  install(PROGRAMS ${CMAKE_CURRENT_BINARY_DIR}/to_install/${name} DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT bsplib)
endfunction()
bsp2_tool(bspcc.in bspcc)
bsp2_tool(bspcc.in bspcxx)
bsp2_tool(bsprun.in bsprun)
bsp2_tool(bsp2_profile.py bsp2-profile)

# man bsp_put: one source for all pages.
set(man_dir ${CMAKE_CURRENT_BINARY_DIR}/man)
add_custom_command(OUTPUT ${man_dir}/made
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${man_dir}
  COMMAND ${CMAKE_COMMAND} -E make_directory ${man_dir}/man1 ${man_dir}/man3 ${man_dir}/man7
  COMMAND awk -v "version=${PROJECT_VERSION}" -v "folder=${man_dir}" -f ${CMAKE_CURRENT_SOURCE_DIR}/man/make_pages.awk
    ${CMAKE_CURRENT_SOURCE_DIR}/man/pages.txt
  COMMAND ${CMAKE_COMMAND} -E touch ${man_dir}/made
  DEPENDS man/make_pages.awk man/pages.txt
  VERBATIM)
add_custom_target(bsp2_man ALL DEPENDS ${man_dir}/made)
install(DIRECTORY ${man_dir}/man1 ${man_dir}/man3 ${man_dir}/man7 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT bsplib)
