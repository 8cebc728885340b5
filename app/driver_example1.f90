!> Example 1 of the paper (section 4.3): a heavy top, by a symmetric splitting whose coefficients stand in
!> the init file. Writes records of m(3), Q(9), t at the start and after every step.
program driver_example1
    use frb, only: wp, frb_step, status_ok, status_message
    use frb_driver_command, only: begin_run, fail, fail_run
    use frb_driver_watch, only: run_watch
    use frb_init_files, only: init_values
    use frb_out_files, only: out_file
    implicit none
    type(init_values) :: start
    type(out_file) :: out
    type(run_watch) :: watch
    character(:), allocatable :: error
    real(wp) :: m(3), attitude(3, 3)
    integer :: i, stat

    call begin_run(1, start, out)
    m = start%m
    attitude = start%attitude
    call watch%begin(start%steps, start%u0)
    call record(0)
    do i = 1, start%steps
        call watch%begin_step()
        call heavy_top_step(start, m, attitude, stat)
        call watch%end_step()
        if (stat /= status_ok) call fail_run(out, 'frb_step: '//status_message(stat))
        call record(i)
    end do
    call out%commit(error)
    if (allocated(error)) call fail(error)
    call watch%report('driver_example1: heavy top, sixth-order splitting', start%h, out)

contains

    !> One step A(a1) B(b1) ... A(a7) B(b7) A(a8) B(b7) A(a7) ... B(b1) A(a1): A the free body, B the kick.
    subroutine heavy_top_step(top, m, attitude, stat)
        type(init_values), intent(in) :: top
        real(wp), intent(inout) :: m(3), attitude(3, 3)
        integer, intent(out) :: stat
        integer :: j

        do j = 1, 7
            call frb_step(m, attitude, top%a(j)*top%h, top%moments, m, attitude, stat=stat)
            if (stat /= status_ok) return
            call kick(m, attitude, top%b(j)*top%h, top%u0)
        end do
        call frb_step(m, attitude, top%a(8)*top%h, top%moments, m, attitude, stat=stat)
        if (stat /= status_ok) return
        do j = 7, 1, -1
            call kick(m, attitude, top%b(j)*top%h, top%u0)
            call frb_step(m, attitude, top%a(j)*top%h, top%moments, m, attitude, stat=stat)
            if (stat /= status_ok) return
        end do
    end subroutine heavy_top_step

    !> The torque of gravity for a time h at a fixed attitude: u = Q^T u0, m1 += h u2, m2 -= h u1.
    pure subroutine kick(m, attitude, h, u0)
        real(wp), intent(inout) :: m(3)
        real(wp), intent(in) :: attitude(3, 3), h, u0(3)
        real(wp) :: u(3)

        u = matmul(u0, attitude)
        m(1) = m(1) + h*u(2)
        m(2) = m(2) - h*u(1)
    end subroutine kick

    !> Notes and writes the state after step i.
    subroutine record(i)
        integer, intent(in) :: i

        call watch%note(m, attitude, start%moments)
        call out%write_record([m, reshape(attitude, [9]), (real(i, wp)/start%steps)*start%t_final], error)
        if (allocated(error)) call fail_run(out, error)
    end subroutine record

end program driver_example1
