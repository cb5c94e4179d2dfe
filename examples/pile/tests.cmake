# Short runs of pile. What each must print or answer is stated, so that each can fail.

# add_pile_test(<name> <exit code> <text> <options>...)
# Runs pile and looks at its exit code and for the text in what it prints.
function(add_pile_test name exit_code text)
  add_test(
    NAME "examples.pile.${name}"
    COMMAND ${CMAKE_COMMAND} "-DPROGRAM=$<TARGET_FILE:pile>" "-DOPTIONS=${ARGN}" "-DEXIT_CODE=${exit_code}"
            "-DTEXT=${text}" -P "${CMAKE_CURRENT_SOURCE_DIR}/run_and_compare.cmake")
  set_tests_properties("examples.pile.${name}" PROPERTIES LABELS examples TIMEOUT 120)
endfunction()

# Every scene: its full static geometry and few enough bodies, from the fall to the heap.
set(checked " 0 below the ground.*frames are those of dHashSpace")
add_pile_test(cubes 0 "${checked}" --scene cubes --bodies 2000 --steps 150 --check)
add_pile_test(balls 0 "${checked}" --scene balls --bodies 2000 --steps 250 --check)
add_pile_test(skittles 0 "${checked}" --scene skittles --bodies 40 --steps 250 --check)
add_pile_test(torus 0 "${checked}" --scene torus --bodies 60 --steps 300 --check)
add_pile_test(alphabet 0 "${checked}" --scene alphabet --steps 400 --check)

# Every way to find the pairs.
foreach(method sweep brute-force axis-lists)
  add_pile_test(${method} 0 "dParallelSAPSpace \\(${method}, cpu.*${checked}" --bodies 1000 --steps 30 --method ${method}
                --backend cpu --threads 2 --check)
endforeach()
foreach(space hash sap simple)
  add_pile_test(${space} 0 "d[A-Z][a-zA-Z]*Space\n.*${checked}" --scene balls --bodies 300 --steps 30 --space ${space} --check)
endforeach()

# Geoms that move and geoms that sleep come from another space.
add_pile_test(settled 0 "dHashSpace\n.*[1-9][0-9]* of 300 bodies asleep" --bodies 300 --settle 300 --steps 2 --space hash)

# The pairs come in the same order whatever finds them, so the piles are the same to the last bit.
add_test(
  NAME examples.pile.same-for-all-methods
  COMMAND ${CMAKE_COMMAND} "-DPROGRAM=$<TARGET_FILE:pile>" "-DOPTIONS=--bodies;1500;--steps;200"
          "-DFIRST=--method;sweep;--threads;2" "-DSECOND=--method;brute-force;--threads;1"
          "-DFOLDER=${CMAKE_CURRENT_BINARY_DIR}" -P "${CMAKE_CURRENT_SOURCE_DIR}/compare_runs.cmake")
set_tests_properties(examples.pile.same-for-all-methods PROPERTIES LABELS examples TIMEOUT 120)

# The narrow phase in a loop or on threads: the same contacts, so again the same piles.
add_test(
  NAME examples.pile.same-narrow-phase
  COMMAND ${CMAKE_COMMAND} "-DPROGRAM=$<TARGET_FILE:pile>" "-DOPTIONS=--scene;torus;--bodies;60;--steps;150"
          "-DFIRST=--narrow;serial" "-DSECOND=--narrow;parallel;--threads;3"
          "-DFOLDER=${CMAKE_CURRENT_BINARY_DIR}/narrow" -P "${CMAKE_CURRENT_SOURCE_DIR}/compare_runs.cmake")
set_tests_properties(examples.pile.same-narrow-phase PROPERTIES LABELS examples TIMEOUT 120)
# The check must not find what is timed before.
add_pile_test(narrow-check 0 "extract pairs +[0-9.]*[1-9].*${checked}" --scene balls --bodies 500 --steps 100 --narrow parallel --check)

# dSweepAndPruneSpace reports a plane with every geom, so the check must find a difference.
add_pile_test(check-can-fail 1 "frame 1: the pair \\(0, 1\\) is not one of dHashSpace's"
              --scene alphabet --bodies 30 --steps 10 --space sap --check)

# The sizes of the paper's scenes.
add_pile_test(size-cubes 0 "20,000 boxes onto a terrain of 240 tiles \\(300,000 triangles\\)" --scene cubes --steps 1)
add_pile_test(size-balls 0 "10,000 spheres onto a bowl \\(600 triangles\\)" --scene balls --steps 1)
add_pile_test(size-skittles 0 "3,500 skittles \\(70,000,000 triangles\\)" --scene skittles --steps 1)
add_pile_test(size-torus 0 "1,000 tori \\(2,304,000 triangles\\)" --scene torus --steps 1)
add_pile_test(size-alphabet 0 "260 letters \\(31,680 triangles\\)" --scene alphabet --steps 1)

# What else a scene sets, shown by a single body.
add_pile_test(default-is-cubes 0 "^cubes: 1 body .*\n300 steps of 0.01 s, seed 1\n" --bodies 1)

add_pile_test(help 0 "alphabet +260 letters" --help)
add_pile_test(unknown-scene 2 "--scene: marbles not in" --scene marbles)
add_pile_test(unknown-option 2 "--colour" --colour red)
add_pile_test(negative-bodies 2 "--bodies: Value -5 not in range" --bodies -5)
add_pile_test(negative-seed 2 "--seed: Value -3 not in range" --seed -3)
foreach(option --threads=2 --method=sweep --backend=cpu --narrow=parallel --compare=5)
  add_pile_test(elsewhere${option} 2 "--narrow parallel and --compare need --space parallel" --space hash ${option})
endforeach()
add_pile_test(unwritable-csv 2 "cannot write the file /no/such/folder/file.csv" --csv /no/such/folder/file.csv)
add_pile_test(too-many-to-check 2 "takes at most" --bodies 200000 --check)
add_pile_test(jpeg 2 "--snapshot: x.jpg does not end with .png" --snapshot x.jpg)

# Parts that no run shows for certain.
add_executable(pile-parts-test parts_test.cpp)
target_compile_features(pile-parts-test PRIVATE cxx_std_17)
target_link_libraries(pile-parts-test PRIVATE pile-parts)
enable_warnings(pile-parts-test)
add_test(NAME examples.pile.parts COMMAND pile-parts-test)
set_tests_properties(examples.pile.parts PROPERTIES LABELS examples TIMEOUT 120)

# What options do and what is written where.
find_program(ODE_PARALLEL_SAP_PYTHON python3 HINTS /usr/bin)  # the system's: it has the system's matplotlib
if(ODE_PARALLEL_SAP_PYTHON)
  add_test(NAME examples.pile.options COMMAND "${ODE_PARALLEL_SAP_PYTHON}" "${CMAKE_CURRENT_SOURCE_DIR}/pile_test.py"
                                              $<TARGET_FILE:pile>)
  set_tests_properties(examples.pile.options PROPERTIES LABELS examples TIMEOUT 300)
else()
  add_test(NAME examples.pile.options COMMAND ${CMAKE_COMMAND} -E echo "Skipped: needs Debian's python3")
  set_tests_properties(examples.pile.options PROPERTIES LABELS examples SKIP_REGULAR_EXPRESSION Skipped)
endif()

# Pictures, by what is in them.
if(PILE_HAS_VIEW AND ODE_PARALLEL_SAP_PYTHON)
  foreach(look scenes readme window)
    add_test(NAME "examples.pile.view-${look}" COMMAND "${ODE_PARALLEL_SAP_PYTHON}" "${CMAKE_CURRENT_SOURCE_DIR}/view/look.py"
                                                       $<TARGET_FILE:pile> ${look})
    set_tests_properties("examples.pile.view-${look}" PROPERTIES LABELS examples TIMEOUT 300 SKIP_RETURN_CODE 77)
  endforeach()
  add_pile_test(unwritable-picture 2 "cannot write the file /no/such/a.png" --snapshot /no/such/a.png)
  add_test(NAME examples.pile.no-display
           COMMAND ${CMAKE_COMMAND} -E env --unset=DISPLAY ${CMAKE_COMMAND} "-DPROGRAM=$<TARGET_FILE:pile>"
                   -DOPTIONS=--view -DEXIT_CODE=2 "-DTEXT=--view needs an X11 display"
                   -P "${CMAKE_CURRENT_SOURCE_DIR}/run_and_compare.cmake")
  set_tests_properties(examples.pile.no-display PROPERTIES LABELS examples TIMEOUT 60)
else()
  add_test(NAME examples.pile.view COMMAND ${CMAKE_COMMAND} -E echo "Skipped: no Python, or none of what drawstuff needs")
  set_tests_properties(examples.pile.view PROPERTIES LABELS examples SKIP_REGULAR_EXPRESSION Skipped)
endif()
if(NOT PILE_HAS_VIEW)
  add_pile_test(no-view 2 "are not in this build: .*libglvnd-dev" --view)
endif()
