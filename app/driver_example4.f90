!> Example 4 of the paper: a free rigid body in N steps, attitude a quaternion, by `quat_step`.
!> Exact or with np Gauss points; writes records of m(3), q(4), t after every step.
program driver_example4
    use frb, only: wp, quat_step, status_ok, status_message
    use frb_driver_command, only: begin_run, fail, fail_run
    use frb_driver_watch, only: run_watch
    use frb_init_files, only: init_values
    use frb_out_files, only: out_file
    implicit none
    type(init_values) :: start
    type(out_file) :: out
    type(run_watch) :: watch
    character(:), allocatable :: error
    real(wp) :: m(3), q(4)
    integer :: i, stat

    call begin_run(4, start, out)
    m = start%m
    q = start%q
    call watch%begin(start%steps)
    call record(0)
    do i = 1, start%steps
        call watch%begin_step()
        call quat_step(m, q, start%h, start%moments, m, q, np=start%points, stat=stat)
        call watch%end_step()
        if (stat /= status_ok) call fail_run(out, 'quat_step: '//status_message(stat))
        call record(i)
    end do
    call out%commit(error)
    if (allocated(error)) call fail(error)
    call watch%report('driver_example4: free rigid body, quaternion', start%h, out)

contains

    !> Notes and writes the state after step i.
    subroutine record(i)
        integer, intent(in) :: i

        call watch%note(m, q, start%moments)
        call out%write_record([m, q, (real(i, wp)/start%steps)*start%t_final], error)
        if (allocated(error)) call fail_run(out, error)
    end subroutine record

end program driver_example4
