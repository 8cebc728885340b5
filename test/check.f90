!> The one test program: every suite, then the closing line `N passed, N failed`.
!> Exit code 1 when a check failed; `--fail` adds a check that must fail, to test the tests; `--published`
!> prints the table of data/published.dat instead.
program check
    use, intrinsic :: iso_fortran_env, only: output_unit
    use frb_checks, only: tally
    use frb_test_base, only: test_base
    use frb_test_bodies, only: test_bodies
    use frb_test_free_motion, only: test_free_motion
    use frb_test_published, only: test_published, print_published
    use frb_test_steps, only: test_steps
    use frb_test_ode45, only: test_ode45
    use frb_test_step_laws, only: test_step_laws
    use frb_test_rivals, only: test_rivals
    use frb_test_files, only: test_files
    use frb_test_carlson, only: test_carlson
    use frb_test_agm, only: test_agm
    use frb_test_schemes, only: test_schemes
    use frb_test_modified_kicks, only: test_modified_kicks
    use frb_test_drifts, only: test_drifts
    use frb_test_splitting, only: test_splitting
    use frb_test_groups, only: test_groups
    use frb_test_legendre, only: test_legendre
    use frb_test_quadrature, only: test_quadrature
    use frb_test_free_flow, only: test_free_flow
    use frb_test_flow_limits, only: test_flow_limits
    use frb_test_flow_laws, only: test_flow_laws
    use frb_test_flow_runs, only: test_flow_runs
    use frb_test_flow_batches, only: test_flow_batches
    use frb_test_flow_series, only: test_flow_series
    implicit none
    type(tally) :: t
    character(16) :: argument

    call get_command_argument(1, argument)
    if (argument == '--published') then
        call print_published()
        stop
    end if
    call test_base(t)
    call test_bodies(t)
    call test_free_motion(t)
    call test_steps(t)
    call test_ode45(t)
    call test_step_laws(t)
    call test_rivals(t)
    call test_files(t)
    call test_carlson(t)
    call test_agm(t)
    call test_schemes(t)
    call test_modified_kicks(t)
    call test_drifts(t)
    call test_splitting(t)
    call test_groups(t)
    call test_legendre(t)
    call test_quadrature(t)
    call test_free_flow(t)
    call test_flow_limits(t)
    call test_flow_laws(t)
    call test_flow_runs(t)
    call test_flow_batches(t)
    call test_flow_series(t)
    call test_published(t)

    if (argument == '--fail') then
        call t%open_suite('self-test', 1)
        call t%ok('this-check-fails-on-purpose', .false.)
        call t%close_suite()
    end if
    if (t%skipped > 0) write (output_unit, '(i0,a)') t%skipped, ' skipped'
    write (output_unit, '(i0,a,i0,a)') t%passed, ' passed, ', t%failed, ' failed'
    if (t%failed > 0) error stop 1
end program check
