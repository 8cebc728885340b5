!> Example 1 of the paper (section 4.3): a heavy top, by a symmetric splitting whose coefficients stand in
!> the init file. Writes records of m(3), Q(9), t at the start and after every step.
!> `--scheme NAME` takes a named scheme in place of the file's, `--drift NAME` a step of the paper in place of
!> the free flow.
program driver_example1
    use frb, only: wp, body_drift, drift_by_name, heavy_top, integrate, mirrored, order_report, rigid_body, &
        scheme_names, splitting_scheme, status_message, status_ok
    use frb_driver_command, only: begin_run, fail, fail_run, joined, read_command, run_command
    use frb_driver_top, only: top_recorder
    use frb_init_files, only: init_values
    use frb_out_files, only: out_file
    implicit none
    !> The reader of the file has checked the sums of the coefficients to this tolerance.
    real(wp), parameter :: digits_of_files = 1.0e-6_wp
    type(init_values) :: start
    type(out_file) :: out
    type(top_recorder) :: recorder
    type(heavy_top) :: top
    type(splitting_scheme) :: scheme
    type(order_report) :: report
    class(body_drift), allocatable :: drift
    type(run_command) :: command
    character(160) :: title
    real(wp) :: m(3), q(4)
    integer :: stat

    ! Names are checked before any file is opened.
    call read_command(1, command)
    if (len(command%scheme) > 0) then
        scheme = splitting_scheme(command%scheme)
        if (scheme%status /= status_ok) then
            call fail('unknown scheme '//command%scheme//'; known are '//joined(scheme_names))
        end if
    end if
    if (len(command%drift) == 0) command%drift = 'free_flow'
    call drift_by_name(command%drift, drift, stat)
    if (stat /= status_ok) then
        call fail('unknown drift '//command%drift//'; known are free_flow, frb_step, quat_step, and'// &
                  ' frb_step:N, quat_step:N with N Gauss points')
    end if
    call begin_run(1, command, start, out)
    if (len(command%scheme) == 0) then
        command%scheme = 'of the file'
        scheme = splitting_scheme(mirrored(start%a, 15), mirrored(start%b, 14), tolerance=digits_of_files)
        if (scheme%status /= status_ok) call fail_run(out, 'the scheme: '//status_message(scheme%status))
    end if

    ! q counts from the attitude Q0 of the file, so that Q = Q0 E(q) and u = Q^T u0 = E(q)^T (Q0^T u0).
    top%force = matmul(start%u0, start%attitude)
    m = start%m
    q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    recorder%start = start
    recorder%out = out
    call recorder%watch%begin(start%steps, start%u0)
    call integrate(rigid_body(start%moments), scheme, top, start%h, start%steps, m, q, recorder, &
                   drift=drift, compensated=.true., stat=stat)
    if (stat /= status_ok) call fail_run(recorder%out, 'integrate: '//status_message(stat))
    report = scheme%conditions()
    write (title, '(a,i0,a,i0,a)') 'driver_example1: heavy top, scheme '//command%scheme//' (', &
        scheme%stages(), ' stages, order ', report%nystroem_order, '), drift '//command%drift
    call recorder%watch%finish(trim(title), start%h, recorder%out)

end program driver_example1
