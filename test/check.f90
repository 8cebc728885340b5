!> The test program: every suite, or the named suites, then the closing line `N passed, N failed`.
!>
!>     fpm test                         all suites
!>     fpm test -- flow-laws steps      these two suites
!>     fpm test -- --list               names of the suites, none is run
!>     fpm test -- --published          the table of data/published.dat
!>     fpm test -- --brief              long runs take a tenth of their steps; before or after names of suites
!>
!> Exit code 1 when a check failed or a name is not known. A run without its closing line has failed,
!> whatever its exit code: something stopped in the suite whose name was written last. Two suites test the
!> tests and run only if they are named: a check fails in `--fail`, the library stops in `--stop`.
program check
    use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
    use frb_checks, only: tally
    use frb_test_base, only: test_base
    use frb_test_bodies, only: test_bodies
    use frb_test_free_motion, only: test_free_motion
    use frb_test_published, only: test_published, print_published
    use frb_test_steps, only: test_steps
    use frb_test_ode45, only: test_ode45
    use frb_test_step_laws, only: test_step_laws
    use frb_test_step_orders, only: test_step_orders
    use frb_test_rivals, only: test_rivals
    use frb_test_files, only: test_files
    use frb_test_files_list, only: test_files_list
    use frb_test_files_out, only: test_files_out
    use frb_test_carlson, only: test_carlson
    use frb_test_agm, only: test_agm
    use frb_test_schemes, only: test_schemes
    use frb_test_extrapolate, only: test_extrapolate
    use frb_test_extrapolate_torques, only: test_extrapolate_torques
    use frb_test_modified_kicks, only: test_modified_kicks
    use frb_test_drifts, only: test_drifts
    use frb_test_splitting, only: test_splitting
    use frb_test_splitting_calls, only: test_splitting_calls
    use frb_test_groups, only: test_groups
    use frb_test_frames, only: test_frames
    use frb_test_open_loop, only: test_open_loop
    use frb_test_open_scenes, only: test_open_scenes
    use frb_test_restarts, only: test_restarts
    use frb_test_legendre, only: test_legendre
    use frb_test_quadrature, only: test_quadrature
    use frb_test_free_flow, only: test_free_flow
    use frb_test_flow_limits, only: test_flow_limits
    use frb_test_flow_scales, only: test_flow_scales
    use frb_test_flow_laws, only: test_flow_laws
    use frb_test_flow_accuracy, only: test_flow_accuracy
    use frb_test_flow_runs, only: test_flow_runs
    use frb_test_flow_batches, only: test_flow_batches
    use frb_test_flow_splits, only: test_flow_splits
    use frb_test_flow_fuzz, only: test_flow_fuzz
    use frb_test_flow_columns, only: test_flow_columns
    use frb_test_flow_series, only: test_flow_series
    use frb_test_status, only: test_status, stop_in_the_library
    use frb_test_tangent, only: test_tangent
    use frb_test_tangent_laws, only: test_tangent_laws
    use frb_test_tangent_runs, only: test_tangent_runs
    use frb_test_tangent_duals, only: test_tangent_duals
    implicit none

    !> Tasks for each suite: look for its name among the arguments, write its name, run it.
    integer, parameter :: looking = 1, listing = 2, running = 3
    type(tally) :: t
    logical, allocatable :: known(:)
    logical :: unnamed      ! no suite is named: all run
    integer :: i

    allocate (known(command_argument_count()), source=.false.)
    call suites(looking)
    unnamed = .not. any(known)
    do i = 1, size(known)
        select case (argument(i))
        case ('--list')
            call suites(listing)
            stop
        case ('--published')
            call print_published()
            stop
        case ('--brief')
            t%brief = .true.
            known(i) = .true.
        case default
        end select
        if (.not. known(i)) then
            write (error_unit, '(a)') 'check: no such suite: '//trim(argument(i))//'; --list shows all names'
            flush (error_unit)
            stop 1
        end if
    end do
    call suites(running)
    deallocate (known)      ! else a sanitizer may report it as lost
    if (t%skipped > 0) write (output_unit, '(i0,a)') t%skipped, ' skipped'
    write (output_unit, '(i0,a,i0,a)') t%passed, ' passed, ', t%failed, ' failed'
    if (t%failed > 0) error stop 1

contains

    !> Every suite, in the order in which they run.
    subroutine suites(task)
        integer, intent(in) :: task

        call suite(task, 'base', test_base)
        call suite(task, 'status', test_status)
        call suite(task, 'bodies', test_bodies)
        call suite(task, 'free-motion', test_free_motion)
        call suite(task, 'steps', test_steps)
        call suite(task, 'ode45', test_ode45)
        call suite(task, 'step-laws', test_step_laws)
        call suite(task, 'step-orders', test_step_orders)
        call suite(task, 'rivals', test_rivals)
        call suite(task, 'files', test_files)
        call suite(task, 'files-list', test_files_list)
        call suite(task, 'files-out', test_files_out)
        call suite(task, 'carlson', test_carlson)
        call suite(task, 'agm', test_agm)
        call suite(task, 'schemes', test_schemes)
        call suite(task, 'modified-kicks', test_modified_kicks)
        call suite(task, 'extrapolate', test_extrapolate)
        call suite(task, 'extrapolate-torques', test_extrapolate_torques)
        call suite(task, 'drifts', test_drifts)
        call suite(task, 'splitting', test_splitting)
        call suite(task, 'splitting-calls', test_splitting_calls)
        call suite(task, 'groups', test_groups)
        call suite(task, 'frames', test_frames)
        call suite(task, 'open-loop', test_open_loop)
        call suite(task, 'open-scenes', test_open_scenes)
        call suite(task, 'restarts', test_restarts)
        call suite(task, 'legendre', test_legendre)
        call suite(task, 'quadrature', test_quadrature)
        call suite(task, 'free-flow', test_free_flow)
        call suite(task, 'flow-limits', test_flow_limits)
        call suite(task, 'flow-scales', test_flow_scales)
        call suite(task, 'flow-laws', test_flow_laws)
        call suite(task, 'flow-accuracy', test_flow_accuracy)
        call suite(task, 'flow-runs', test_flow_runs)
        call suite(task, 'flow-batches', test_flow_batches)
        call suite(task, 'flow-splits', test_flow_splits)
        call suite(task, 'flow-fuzz', test_flow_fuzz)
        call suite(task, 'flow-columns', test_flow_columns)
        call suite(task, 'flow-series', test_flow_series)
        call suite(task, 'tangent', test_tangent)
        call suite(task, 'tangent-laws', test_tangent_laws)
        call suite(task, 'tangent-runs', test_tangent_runs)
        call suite(task, 'tangent-duals', test_tangent_duals)
        call suite(task, 'published', test_published)
        call suite(task, '--fail', fail)
        call suite(task, '--stop', stop_in_the_library)
    end subroutine suites

    !> One suite. Without names among the arguments all suites run but the two that test the tests.
    subroutine suite(task, name, test)
        integer, intent(in) :: task
        character(*), intent(in) :: name
        interface
            subroutine test(t)
                import :: tally
                implicit none
                type(tally), intent(inout) :: t
            end subroutine test
        end interface
        logical :: named(size(known))
        integer :: k

        named = [(argument(k) == name, k=1, size(known))]
        select case (task)
        case (looking)
            known = known .or. named
        case (listing)
            if (name(1:1) /= '-') write (output_unit, '(a)') name
        case default
            if (any(named) .or. (unnamed .and. name(1:1) /= '-')) call test(t)
        end select
    end subroutine suite

    !> An argument of the program.
    function argument(place) result(text)
        integer, intent(in) :: place
        character(32) :: text

        call get_command_argument(place, text)
    end function argument

    subroutine fail(t)
        type(tally), intent(inout) :: t

        call t%open_suite('--fail', 1)
        call t%ok('this-check-fails-on-purpose', .false.)
        call t%close_suite()
    end subroutine fail

end program check
